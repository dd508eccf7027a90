"""`Scene`: one motion, rest hold included, as the whole-sequence estimator would see it.

All that does not depend on where sensors are is computed once: world frames and screws of every
body, the terms from which a point's specific force and its rate of change follow, and the
information of the priors, which is the estimator's own.

A point s of a body (body frame) has the specific force f(s) = c + N s with c = R'(p'' - g) and
N = R'R''. So the squared jerk, which decides how wrong a lagging board reads, is a quadratic form
of (1, s): its mean around each frame is kept as a 4x4 matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.ndimage import uniform_filter1d

from mocap_jax.body import Body, Frames, frames
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.placement.kinematics import Kinematics
from mocap_jax.placement.options import PlacementOptions
from mocap_jax.placement.prior import Habits, Prior, habits_of, prior_of
from mocap_jax.placement.targets import Targets, targets_of
from mocap_jax.simulation import SimulationOptions
from mocap_jax.simulation.rest_hold import Performance, perform

# Rate at which kinematics are differentiated [Hz], and the window of local mean squares [s] (that
# of the estimator's own variances).
_FINE = 120.0
_MEMORY = 0.2
_STRETCH = 64
# Length of the rest hold [s]: longer ones tell little more.
_REST = 0.5


@dataclass(frozen=True)
class Scene:
    """One motion of a study."""

    name: str
    body: Body
    kinematics: Kinematics
    frames: int
    """Frames that are no padding."""
    prior: Prior
    poses: Float[np.ndarray, "t nq"]
    targets: Targets
    joints: tuple[str, ...]
    quantity: str
    """What the study asks for, one of the targets."""

    @property
    def target(self) -> Float[np.ndarray, "j t 3 nv"]:
        """Derivatives of what the study asks for."""
        return self.targets[self.quantity]


def scenes_of(
    body: Body, motions: tuple[Motion, ...], options: PlacementOptions
) -> tuple[Scene, ...]:
    """Prepare all motions of a study, padded to one length.

    Args:
        body: who performs them; all motions must be of this body.
        motions: clips.
        options: grid, priors, joints that count.

    Raises:
        InputError: no motion, a motion of another body, an unknown joint.
    """
    if not motions:
        raise InputError("motions: at least one is needed")
    for motion in motions:
        if motion.body.topology.body_names != body.topology.body_names:
            raise InputError(
                f"motion '{motion.name}' is of another body; retarget it first "
                "(mocap_jax.retarget(motion, body))"
            )
    performances = [performance_of(m) for m in motions]
    longest = max(_count(p, options.rate_hz) for p in performances)
    habits = _habits(body, performances, options) if options.habits == "motions" else None
    return tuple(
        _scene(body, m.name, p, longest, options, habits)
        for m, p in zip(motions, performances, strict=True)
    )


def performance_of(motion: Motion) -> Performance:
    """A clip with a short rest hold and the blend from it."""
    return perform(motion, SimulationOptions(rest_s=_REST))


def _habits(body: Body, performances: list[Performance], options: PlacementOptions) -> Habits:
    step, poses = 1 / options.rate_hz, []
    for p in performances:
        time = np.arange(p.score_from, p.time[-1], step)
        poses.append(p.spline(body.topology).pose(time))
    return habits_of(body, tuple(poses), step)


def _count(performance: Performance, rate: float) -> int:
    return int(np.floor(performance.time[-1] * rate))


def _scene(
    body: Body, name: str, performance: Performance, longest: int, options: PlacementOptions,
    habits: Habits | None,
) -> Scene:  # fmt: skip
    count, rate = _count(performance, options.rate_hz), options.rate_hz
    time = (np.arange(count) + 0.5) / rate
    kinematics = _kinematics(body, performance, time, longest)
    scored = (time >= performance.score_from).astype(float)
    names, targets = targets_of(body, kinematics, scored, options.joints)
    q = performance.spline(body.topology).pose(time)
    prior = prior_of(body, q, time, performance.rest, options, habits)
    return Scene(name, body, kinematics, count, prior, q, targets, names, options.quantity)


def _kinematics(body: Body, performance: Performance, time: np.ndarray, longest: int) -> Kinematics:
    spline, step = performance.spline(body.topology), float(time[1] - time[0])
    fine_step = 1 / _FINE
    # Fine frames reach beyond both ends: differences need neighbours (the spline ends with the
    # motion, so the last ones repeat).
    fine = np.clip(np.arange(time[0] - 2 * fine_step, time[-1] + 2 * fine_step, fine_step),
                   spline.start, spline.end)  # fmt: skip
    bare = body.replace(xml="")  # The text would be part of the compilation key.
    both = _all_frames(bare, jnp.asarray(spline.pose(np.concatenate([fine, time]))))
    detail, grid = (jax.tree.map(lambda x, r=r: np.asarray(x)[r], both)
                    for r in (slice(len(fine)), slice(len(fine), None)))  # fmt: skip
    R, p = np.asarray(detail.rotation), np.asarray(detail.position)
    moving = _moving(R, p, np.asarray(body.gravity), fine_step)
    at = np.searchsorted(fine, time - 0.5 * fine_step).clip(0, len(fine) - 1)
    pad = lambda x: jnp.asarray(  # noqa: E731
        np.pad(x, [(0, longest - len(x))] + [(0, 0)] * (x.ndim - 1), mode="edge")
    )
    present = np.pad(np.ones(len(time)), (0, longest - len(time)))
    rate, force, jerk, turn, spin = (pad(x[at]) for x in moving)
    return Kinematics(
        rotation=pad(grid.rotation), position=pad(grid.position), angular=pad(grid.angular),
        linear=pad(grid.linear), rate=rate, force=force, jerk=jerk, turn=turn, spin=spin,
        present=jnp.asarray(present), step=jnp.asarray(step),
    )  # fmt: skip


@jax.jit
def _all_frames(body: Body, q: Float[Array, "n nq"]) -> Frames:
    """Frames of poses, a stretch at a time: one program for motions of any length."""
    padded = jnp.pad(q, ((0, -len(q) % _STRETCH), (0, 0)), mode="edge")
    stretches = padded.reshape(-1, _STRETCH, q.shape[1])
    out = jax.lax.map(jax.vmap(lambda x: frames(body, x)), stretches)
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:])[: len(q)], out)


def _moving(R: np.ndarray, p: np.ndarray, gravity: np.ndarray, step: float) -> tuple:
    """Rate, force terms and local mean squares, from frames at a fine rate."""
    second = lambda x: np.gradient(np.gradient(x, step, axis=0), step, axis=0)  # noqa: E731
    turned = np.swapaxes(R, -1, -2)
    spinning = turned @ np.gradient(R, step, axis=0)
    rate = 0.5 * np.stack(
        [spinning[..., 2, 1] - spinning[..., 1, 2], spinning[..., 0, 2] - spinning[..., 2, 0],
         spinning[..., 1, 0] - spinning[..., 0, 1]], -1,
    )  # fmt: skip
    centre = (turned @ (second(p) - gravity)[..., None])[..., 0]
    force = np.concatenate([centre[..., None], turned @ second(R)], -1)
    change = np.gradient(force, step, axis=0)
    jerk = np.einsum("tbij,tbik->tbjk", change, change)
    alpha = (np.gradient(rate, step, axis=0) ** 2).sum(-1)
    spin = (rate**2).sum(-1) ** 2
    window = 2 * round(_MEMORY / (2 * step)) + 1
    local = lambda x: uniform_filter1d(x, window, axis=0, mode="nearest")  # noqa: E731
    return rate, force, local(jerk), local(alpha), local(spin)
