"""Where the whole-sequence optimiser starts: an earlier solution brought to its frame grid."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax.body import Body, difference, retract
from mocap_jax.errors import InputError
from mocap_jax.estimate.filter import run_ekf
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.inputs import uses_root
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.initialise import rest_pose
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status
from mocap_jax.trajectory import Trajectory

# Distances that count for more than in a filter's own result keep the trunk, whose joints no board
# observes one by one, from folding: the solve would have to unfold it first [m].
_RANGE_MODEL = 0.02
# The slowest grid on which a filter follows a person [Hz]: walking is off by 1.1 degrees at 140 and
# 60 Hz, 1.9 at 20, and lost at 12, which the whole sequence at once is not.
_SLOWEST = 60.0


def first_guess(
    recording: Recording, body: Body, options: OptimiseOptions, *, progress: bool,
    meanwhile: Callable[[], object] = lambda: None,
) -> Solution:  # fmt: skip
    """Run the estimator that `options.initial` names, on kinds that do not lead it astray.

    Without rates or orientations, accelerations turn a filter's headings away within seconds:
    distances alone then make the guess, or the rest pose where there are none. `meanwhile` is
    called as soon as the estimator's own programs are being compiled.
    """
    kinds = options.kinds
    if not set(kinds) & set("GO"):
        kinds = kinds.replace("A", "").replace("M", "")
    if not kinds or (kinds == "D" and recording.ranges is None):
        meanwhile()
        return at_rest(recording, body, use_root=uses_root(recording, options.root))
    smooth = options.initial == "ekf_smoothed"
    settings = EkfOptions(
        kinds=kinds, root=options.root, rate_hz=_filter_rate(options), smooth=smooth,
        covariance=False, range_model=_RANGE_MODEL,
        magnetic_north=options.magnetic_north, magnetic_sigma=options.magnetic_sigma,
        magnetic_time=options.magnetic_time, range_facing=options.noise.range_facing,
        gravity=options.gravity,
    )  # fmt: skip
    return run_ekf(recording, body, settings, progress=progress, meanwhile=meanwhile)


def _filter_rate(options: OptimiseOptions) -> float | None:
    """The options' own grid, or the sensors' where that is too slow for a filter."""
    rate = options.rate_hz
    return rate if rate is not None and rate >= _SLOWEST else None


def at_rest(recording: Recording, body: Body, *, use_root: bool) -> Solution:
    """The rest pose held for all times, carried by the measured root if that is used."""
    rest = rest_pose(recording, body, use_root=use_root)
    root = recording.root if use_root and body.has_free_root else None
    time = np.array(recording.interval) if root is None else np.asarray(root.time)
    q = np.tile(rest.q, (len(time), 1))
    if root is not None:
        position, quat = np.asarray(root.position), np.asarray(root.orientation)
        if not np.isfinite(quat).any():  # positions alone: the rest pose's orientation stays
            quat = q[:, 3:7]
        q[:, :3], q[:, 3:7] = position, quat
        known = np.isfinite(q).all(axis=1)
        time, q = time[known], q[known]
    constants = {
        f"{key}/{name}": values[i]
        for key, values in (
            ("gyroscope_bias", rest.gyroscope_bias),
            ("accelerometer_bias", rest.accelerometer_bias),
            ("mounting_rotation", rest.mounting_rotation),
        )
        for i, name in enumerate(rest.sensors)
    }
    return Solution(
        trajectory=Trajectory(time, q),
        body=body,
        status=Status.FILTERED,
        method="rest",
        setup=recording.setup,
        remarks=rest.remarks,
        calibration=constants,
    )


def on_grid(initial: Solution, body: Body, time: np.ndarray) -> np.ndarray:
    """Poses of an earlier solution at other times (t, nq), interpolated along geodesics.

    Raises:
        InputError: the solution belongs to a body with other joints, or is not finite.
    """
    ours, theirs = body.topology, initial.body.topology
    if ours.joint_types != theirs.joint_types or ours.nq != initial.trajectory.q.shape[1]:
        raise InputError(
            f"initial solution: its body has {theirs.njoint} joints ({theirs.nq} coordinates), "
            f"this one {ours.njoint} ({ours.nq}); use a solution of the same body"
        )
    q = np.asarray(initial.trajectory.q)
    if not np.isfinite(q).all():
        raise InputError("initial solution: its poses are not finite (its solve failed)")
    known = np.asarray(initial.trajectory.time)
    if len(known) == len(time) and np.allclose(known, time, atol=1e-9):
        return q
    right = np.clip(np.searchsorted(known, time), 1, len(known) - 1)
    share = np.clip((time - known[right - 1]) / (known[right] - known[right - 1]), 0.0, 1.0)

    @jax.jit
    @jax.vmap
    def between(a: jax.Array, b: jax.Array, s: jax.Array) -> jax.Array:
        return retract(ours, a, s * difference(ours, a, b))

    return np.asarray(between(jnp.asarray(q[right - 1]), jnp.asarray(q[right]), jnp.asarray(share)))
