"""Bring an estimate and its reference to the same frames."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, Topology, difference, load_body, retract
from mocap_jax.errors import InputError
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution
from mocap_jax.solution.poses import map_frames
from mocap_jax.trajectory import Trajectory

# An estimate may run past the truth's end by this part of the truth's step.
_OVERRUN = 0.5


@dataclass(frozen=True)
class Aligned:
    """Poses of the estimate and of the reference at the same times."""

    time: Float[np.ndarray, "t"]
    frames: np.ndarray
    """Which frames of the solution these are."""
    body: Body
    q: Float[np.ndarray, "t nq"]
    reference_body: Body
    reference_q: Float[np.ndarray, "t nq_reference"]

    @property
    def same_structure(self) -> bool:
        """Whether both bodies have the same tree of joints (lengths and sites may differ)."""
        key = lambda t: (t.body_names, t.body_parent, t.joint_types, t.joint_body)  # noqa: E731
        return key(self.body.topology) == key(self.reference_body.topology)


@jax.jit
def _blend(body: Body, start: jax.Array, end: jax.Array, part: jax.Array) -> jax.Array:
    topology = body.topology
    one = lambda a, b, s: retract(topology, a, s * difference(topology, a, b))  # noqa: E731
    return jax.vmap(one)(start, end, part)


def interpolate(
    body: Body, trajectory: Trajectory, time: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n nq"]:
    """Poses at other times, along the geodesic between neighbouring frames (slerp).

    Times outside the trajectory get its first or last pose.
    """
    t, q = np.asarray(trajectory.time), np.asarray(trajectory.q)
    if len(t) == 1:
        return np.repeat(q, len(time), axis=0)
    left = np.clip(np.searchsorted(t, time, side="right") - 1, 0, len(t) - 2)
    part = np.clip((time - t[left]) / (t[left + 1] - t[left]), 0.0, 1.0)
    return map_frames(_blend, (body,), q[left], q[left + 1], part)


def truth_of(reference: Recording | Solution) -> tuple[Body, Trajectory]:
    """Body and trajectory of a reference; raises `InputError` for a recording without truth."""
    if isinstance(reference, Solution):
        return reference.body, reference.trajectory
    if reference.truth is None:
        raise InputError(
            "the reference recording holds no truth (only simulated ones do); give one that was "
            "simulated, or another solution"
        )
    return load_body(reference.truth.body_xml), reference.truth.trajectory


def align(
    solution: Solution, reference: Recording | Solution, from_time: float | None = None
) -> Aligned:
    """Interpolate the reference at the solution's times, from `from_time` on.

    Args:
        solution: the estimate.
        reference: a recording with truth, or another solution.
        from_time: first time scored [s]; None for `solution.setup.score_from`.

    Raises:
        InputError: no truth, no frames in common, or no segments in common.
    """
    body, trajectory = truth_of(reference)
    time = np.asarray(solution.trajectory.time)
    true_time = np.asarray(trajectory.time)
    if not len(true_time):
        raise InputError("the reference has no frames")
    start = solution.setup.score_from if from_time is None else from_time
    margin = _OVERRUN * float(np.median(np.diff(true_time))) if len(true_time) > 1 else 1e-9
    inside = (time >= start - 1e-9) & (time >= true_time[0] - margin)
    chosen = np.flatnonzero(inside & (time <= true_time[-1] + margin))
    if not len(chosen):
        span = f"{time[0]:g} to {time[-1]:g} s" if len(time) else "no frames"
        raise InputError(
            f"no frames to score: the solution has {span}, the reference {true_time[0]:g} to "
            f"{true_time[-1]:g} s, and errors are scored from {start:g} s on"
        )
    q = np.asarray(solution.trajectory.q)[chosen]
    return Aligned(
        time[chosen], chosen, solution.body, q, body, interpolate(body, trajectory, time[chosen])
    )


def common_segments(
    first: Topology, second: Topology, segments: list[int]
) -> list[tuple[int, int]]:
    """Pairs of indices of the same-named segments, among those of the first body given."""
    index = {name: i for i, name in enumerate(second.body_names)}
    return [(b, index[first.body_names[b]]) for b in segments if first.body_names[b] in index]
