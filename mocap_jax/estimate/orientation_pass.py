"""`orientation_pass`: poses from measured orientations alone, each frame by itself."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from mocap_jax import so3
from mocap_jax.body import Body
from mocap_jax.errors import InputError, SolveError
from mocap_jax.estimate.central_velocity import central_velocity
from mocap_jax.estimate.compile_clock import CompileClock
from mocap_jax.estimate.inputs import body_of, mounting_remarks, uses_root
from mocap_jax.estimate.observed_joints import observed_joints
from mocap_jax.estimate.orientation_frame import (
    FrameFit,
    FrameProblem,
    frame_problem,
    rules_of,
    solve_frame,
)
from mocap_jax.estimate.orientation_options import OrientationPassOptions
from mocap_jax.estimate.orientation_prior import frame_prior
from mocap_jax.measurement import FrameData, gather
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status
from mocap_jax.stored_programs import StoredProgram
from mocap_jax.trajectory import Trajectory

METHOD = "orientation_pass"
# Frames per compiled program: of the pass along the frames, and of the one over all at once.
_ALONG, _AT_ONCE = 64, 256


def orientation_pass(
    recording: Recording,
    body: Body | None = None,
    *,
    start: np.ndarray | None = None,
    options: OrientationPassOptions = OrientationPassOptions(),  # noqa: B008  (frozen)
    progress: bool = False,
    throw: bool = False,
) -> Solution:
    """Fit a pose to the measured orientations of each frame: inverse kinematics of sensors.

    The cost is OpenSim's, the weighted sum of squared angles between measured and predicted
    sensors, and with a pose prior that of the Sparse Orientation Poser (von Marcard 2017, section
    4.5). Nothing ties frames together. What neither tells (the root's position, and joints between
    no two sensors) stays as in `start`; a recorded root gives the position unless `options.root`
    says that it is free.

    Args:
        recording: with measured orientations, in the body's world.
        body: nominal body whose sites carry the sensors; default the recording's own. It is given
            a free root if it has none.
        start: pose (nq,) to start from; default the body's reference pose.
        options: see `OrientationPassOptions`.
        progress: show a progress bar (stderr).
        throw: raise `SolveError` instead of returning a failed solution.

    Returns:
        Poses; `statistics` has the angle of error of each sensor under `orientation/<sensor>`.

    Raises:
        InputError: no measured orientations, no body, unknown sensors, or wrong options.
    """
    clock, begin = CompileClock(), time.perf_counter()
    with clock:
        body = body_of(recording, body)
        data = gather(recording, body, kinds="O", rate_hz=options.rate_hz)
        options.check(data.sensors)
        root_given = uses_root(recording, options.root)
        weight, R_world_sensor = _measured(data, options)
        prior = frame_prior(
            body, options.pose_prior, options.orientation_sigma, options.share_sigma
        )
        problem = frame_problem(body, data.sites, options.residuals, prior)
        if start is None:
            start = np.asarray(body.qpos0)
        elif np.shape(start) != (body.nq,) or not np.isfinite(start).all():
            raise InputError(f"start must be {body.nq} finite numbers, as q of this body")
        fit = _fit(problem, body, options, start, weight, R_world_sensor, progress=progress)
        solution = _solution(recording, body, data, options, fit, weight, root_given=root_given)
    seconds = time.perf_counter() - begin
    solution = dataclasses.replace(
        solution, seconds_solve=seconds - clock.seconds, seconds_compile=clock.seconds
    )
    if throw and not solution.status.ok:
        raise SolveError(solution.status.value)
    return solution


def _measured(data: FrameData, options: OrientationPassOptions) -> tuple[np.ndarray, np.ndarray]:
    """Weights (t, s), zero where nothing was measured, and orientations (t, s, 3, 3)."""
    quat = np.asarray(data.orientation)
    known = np.isfinite(quat).all(axis=-1)
    if not known.any():
        raise InputError(
            "the recording has no measured orientations; valid for others: optimise, ekf"
        )
    quat = np.where(known[..., None], quat, [1.0, 0.0, 0.0, 0.0])
    R = np.asarray(so3.quat_to_matrix(so3.quat_normalise(jnp.asarray(quat))))
    return known * np.array([options.weights.get(s, 1.0) for s in data.sensors]), R


def _fit(
    problem: FrameProblem, body: Body, options: OrientationPassOptions, start: np.ndarray,
    weight: np.ndarray, R_world_sensor: np.ndarray, *, progress: bool,
) -> FrameFit:  # fmt: skip
    """Fit all frames; NumPy arrays with the frame axis first."""
    rules = rules_of(
        body, problem, limits=options.limits, iterations=options.iterations,
        tolerance=options.tolerance,
    )  # fmt: skip
    # The text of the model is part of the compilation key and has no part in the kinematics.
    fixed = (rules, dataclasses.replace(body, xml=""))
    count = len(weight)
    start = _root_as_measured(problem, body, start, weight[0], R_world_sensor[0])
    every = 1 if options.warm_start else options.seed_every
    seeds = np.arange(0, count, every)
    with tqdm(desc=METHOD, total=count, unit="frame", disable=not progress) as bar:
        along = _chunks(
            partial(_along, problem, fixed), _ALONG, bar if every == 1 else None, start,
            weight[seeds], R_world_sensor[seeds],
        )  # fmt: skip
        if every == 1:
            return along
        nearest = np.minimum((np.arange(count) + every // 2) // every, len(seeds) - 1)
        return _chunks(
            partial(_at_once, problem, fixed), _AT_ONCE, bar, None,
            along.q[nearest], weight, R_world_sensor,
        )  # fmt: skip


def _root_as_measured(
    problem: FrameProblem, body: Body, start: np.ndarray, weight: np.ndarray, R: np.ndarray
) -> np.ndarray:
    """The start with its free root turned as a sensor on the root says, if there is one."""
    topology = body.topology
    if not body.has_free_root:
        return start
    for i, site in enumerate(problem.sites):
        if topology.site_body[site] == topology.joint_body[0] and weight[i] > 0:
            R_root_sensor = so3.quat_to_matrix(so3.quat_normalise(body.site_quat[site]))
            turned = np.array(start, float)
            turned[3:7] = np.asarray(so3.quat_from_matrix(jnp.asarray(R[i]) @ R_root_sensor.T))
            return turned
    return start


def _chunks(
    solve: Callable[..., FrameFit], size: int, bar: tqdm | None, carry: np.ndarray | None,
    *arrays: np.ndarray,
) -> FrameFit:  # fmt: skip
    """Apply a compiled program to chunks of one size; `carry` goes from one to the next."""
    pieces = []
    for begin in range(0, len(arrays[0]), size):
        chunk = [a[begin : begin + size] for a in arrays]
        used = len(chunk[0])
        chunk = [np.concatenate([c, np.repeat(c[-1:], size - used, axis=0)]) for c in chunk]
        result = solve(*chunk) if carry is None else solve(carry, *chunk)
        piece = jax.tree.map(lambda x, n=used: np.asarray(x)[:n], result)
        carry = None if carry is None else piece.q[-1]
        pieces.append(piece)
        if bar is not None:
            bar.update(used)
    return jax.tree.map(lambda *parts: np.concatenate(parts), *pieces)


@partial(StoredProgram, static=("problem",))
def _along(
    problem: FrameProblem, fixed: tuple, start: jax.Array, weight: jax.Array,
    R_world_sensor: jax.Array,
) -> FrameFit:  # fmt: skip
    """Frames one after the other, each from the last."""
    rules, body = fixed

    def one(q, frame):
        fit = solve_frame(problem, rules, body, frame[0], q, frame[1])
        return fit.q, fit

    return jax.lax.scan(one, start, (weight, R_world_sensor))[1]


@partial(StoredProgram, static=("problem",))
def _at_once(
    problem: FrameProblem, fixed: tuple, start: jax.Array, weight: jax.Array,
    R_world_sensor: jax.Array,
) -> FrameFit:  # fmt: skip
    """All frames side by side, each from its own start."""
    rules, body = fixed
    one = lambda w, q, R: solve_frame(problem, rules, body, w, q, R)  # noqa: E731
    return jax.vmap(one)(weight, start, R_world_sensor)


def _solution(
    recording: Recording, body: Body, data: FrameData, options: OrientationPassOptions,
    fit: FrameFit, weight: np.ndarray, *, root_given: bool,
) -> Solution:  # fmt: skip
    q = np.array(fit.q)
    known = np.isfinite(np.asarray(data.root_position)).all(axis=1)
    if body.has_free_root and root_given and known.any():
        # Where the root is missing for a while, it is taken to go on straight.
        times = np.asarray(data.time)
        for k in range(3):
            q[:, k] = np.interp(times, times[known], np.asarray(data.root_position)[known, k])
    finite = bool(np.isfinite(q).all())
    status, remarks = _outcome(fit, options.iterations)
    return Solution(
        trajectory=Trajectory(
            np.asarray(data.time), q, central_velocity(body, q, float(data.step))
        ),
        body=body,
        status=status if finite else Status.DIVERGED,
        method=METHOD,
        setup=recording.setup,
        remarks=(*recording.salvage, *mounting_remarks(recording), *remarks),
        observed=observed_joints(body, data),
        cost=(0.5 * float(fit.cost.sum()),),
        iterations=int(fit.iterations.sum()),
        statistics=_statistics(data, fit, weight),
        options={"weights": dict(options.weights), "limits": options.limits,
                 "warm_start": options.warm_start, "residuals": len(options.residuals),
                 "pose_prior": options.pose_prior.name if options.pose_prior else None},
    )  # fmt: skip


def _outcome(fit: FrameFit, most: int) -> tuple[Status, list[str]]:
    """The status of all frames together, and what to say of those that did not converge."""
    late = int((~fit.converged & (fit.iterations >= most)).sum())
    stuck = int((~fit.converged).sum()) - late
    total, remarks = len(fit.converged), []
    if late:
        remarks.append(f"{late} of {total} frames reached the largest number of steps.")
    if stuck:
        remarks.append(f"{stuck} of {total} frames stopped where no step lowers the cost.")
    if stuck:
        return Status.STALLED, remarks
    return Status.MAX_ITERATIONS if late else Status.CONVERGED, remarks


def _statistics(data: FrameData, fit: FrameFit, weight: np.ndarray) -> dict[str, dict[str, float]]:
    """Per sensor what `Solution.statistics` describes; measured minus predicted, per axis."""
    out = {}
    for i, sensor in enumerate(data.sensors):
        used = weight[:, i] > 0
        if not used.any():
            continue
        error, scale = -fit.error[used, i], float(np.sqrt(weight[used, i].max()))
        squared = (error**2).mean(axis=-1)
        rms, bias = float(np.sqrt(squared.mean())), float(np.linalg.norm(error.mean(axis=0)))
        out[f"orientation/{sensor}"] = {
            "rms": rms * scale, "rms_units": rms, "bias": bias * scale, "bias_units": bias,
            "count": int(used.sum()), "outliers": float((squared * scale**2 > 9.0).mean()),
        }  # fmt: skip
    return out
