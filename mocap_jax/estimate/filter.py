"""`ekf`: the extended Kalman filter of Vlasic 2007, section 5, and its backward smoother."""

from __future__ import annotations

import dataclasses
import time
from collections import deque
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from mocap_jax.body import Body
from mocap_jax.body.topology import FREE, SLIDE
from mocap_jax.estimate.compile_clock import CompileClock
from mocap_jax.estimate.filter_chunk import Estimates, filter_chunk, smooth_chunk
from mocap_jax.estimate.filter_data import filter_data
from mocap_jax.estimate.filter_frame import FilterModel, FrameInput, Parameters
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.innovation_statistics import InnovationStatistics
from mocap_jax.estimate.inputs import body_of, gauge_remarks, uses_root
from mocap_jax.estimate.observed_joints import observed_joints
from mocap_jax.estimate.shared_joints import shared_joints
from mocap_jax.initialise import RestEstimate, rest_pose
from mocap_jax.kalman import Dynamics, State, butterworth_rate, process_noise
from mocap_jax.measurement import gather
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status
from mocap_jax.trajectory import Trajectory

_PAPER_RATE_HZ = 140.0
# Memory for filtered beliefs that wait for the smoother (about 16 s of a human at 140 Hz).
_KEPT_BYTES = 5e8


def ekf(
    recording: Recording,
    body: Body | None = None,
    *,
    options: EkfOptions = EkfOptions(),  # noqa: B008  (frozen)
    progress: bool = False,
) -> Solution:
    """Estimate a motion frame by frame with an extended Kalman filter.

    Args:
        recording: measured streams and their set-up.
        body: nominal body whose sites carry the sensors; default the recording's own. It is given
            a free root if it has none.
        options: see `EkfOptions`.
        progress: show a progress bar (stderr).

    Returns:
        Trajectory with velocities, pose covariances and innovation statistics.

    Raises:
        InputError: no body, unknown sensors, or `root="given"` without a measured root.
    """
    clock = CompileClock()
    begin = time.perf_counter()
    # LAPACK of this size on more than one thread is many times slower on a busy machine.
    with clock, threadpool_limits(1, user_api="blas"):
        body = body_of(recording, body)
        use_root = uses_root(recording, options.root)
        rest = rest_pose(recording, body, options=options.rest, use_root=use_root)
        run = prepare(recording, body, options, rest, use_root)
        estimates, statistics, remarks = run_filter(run, options, progress)
    q = np.concatenate([e.q for e in estimates])[: len(run.time)].astype(float)
    v = np.concatenate([e.v for e in estimates])[: len(run.time)].astype(float)
    covariance = None
    if options.covariance:
        covariance = np.concatenate([e.covariance for e in estimates])[: len(run.time)]
    seconds = time.perf_counter() - begin
    return Solution(
        trajectory=Trajectory(np.asarray(run.time), q, v),
        body=body,
        status=_status(q, options),
        method="ekf_smoothed" if options.smooth else "ekf",
        setup=recording.setup,
        remarks=(*rest.remarks, *remarks, *gauge_remarks(use_root)),
        covariance=covariance,
        observed=run.observed,
        seconds_solve=seconds - clock.seconds,
        seconds_compile=clock.seconds,
        statistics=statistics,
        options=_option_record(options),
        **_calibration(rest),  # type: ignore[arg-type]
    )


class FilterRun(NamedTuple):
    """Everything the loops need."""

    body: Body
    model: FilterModel
    parameters: Parameters
    start: State
    chunks: list[FrameInput]
    time: np.ndarray
    statistics: InnovationStatistics
    observed: tuple[str, ...]


def prepare(
    recording: Recording, body: Body, options: EkfOptions, rest: RestEstimate, use_root: bool
) -> FilterRun:
    """Bring a recording, a body and options to what the loops take."""
    data = gather(recording, body, kinds=options.kinds, root=use_root)
    chunks, kinds, range_sites = filter_data(data, rest, options)
    model = FilterModel(options.process, kinds, data.sites, range_sites, options.range_gate)
    dtype = jnp.dtype(options.dtype)
    cast = lambda x: (  # noqa: E731
        jnp.asarray(x, dtype) if np.issubdtype(np.asarray(x).dtype, np.floating) else x
    )
    statistics = InnovationStatistics(data, body, range_sites, options.range_gate)
    return FilterRun(
        # The model's text would be part of the compilation key.
        jax.tree.map(cast, dataclasses.replace(rest.mounted(body), xml="")),
        model,
        jax.tree.map(cast, _parameters(recording, body, options, rest, float(data.step))),
        jax.tree.map(cast, _start(body, options, rest, _seen(body, rest, recording))),
        [jax.tree.map(cast, c) for c in chunks],
        np.asarray(data.time),
        statistics,
        observed_joints(body, data),
    )


def _parameters(
    recording: Recording, body: Body, options: EkfOptions, rest: RestEstimate, step: float
) -> Parameters:
    noise, sensors = recording.setup.noise, len(rest.sensors)
    density = jerk_density(body, options)
    density[~_seen(body, rest, recording)] = 0.0
    each = lambda sigma: jnp.full(sensors, sigma)  # noqa: E731
    # A mismatch of a tenth is what the noise of a clean recording makes.
    shown = max(rest.mismatch - 0.1, 0.0) / 0.9
    return Parameters(
        dynamics=_dynamics(body, options, rest, density, step),
        accelerometer_sigma=each(noise.accelerometer),
        gyroscope_sigma=each(noise.gyroscope),
        orientation_sigma=each(noise.orientation),
        range_sigma=jnp.hypot(noise.range, shown * options.range_model),
        root_sigma=jnp.asarray([noise.root_position] * 3 + [noise.root_orientation] * 3),
        lever_arm_sigma=jnp.hypot(options.lever_arm_sigma, shown * options.lever_arm_model),
        mounting_sigma=jnp.asarray(_remaining_mounting(rest)),
        speed_of_sound=jnp.asarray(recording.setup.speed_of_sound),
    )


def _dynamics(
    body: Body, options: EkfOptions, rest: RestEstimate, density: np.ndarray, step: float
) -> Dynamics:
    h = jnp.asarray(step)
    noise = process_noise(options.process, h, jnp.asarray(density))
    if options.process != "white_jerk" or options.joint_sigma <= 0:
        return Dynamics(h, noise)
    shared = shared_joints(body, rest.sites)
    sigma = np.where(shared, options.shared_joint_sigma, options.joint_sigma)
    rate = np.array(butterworth_rate(density, sigma))
    for j, kind in enumerate(body.topology.joint_types):
        if kind in (FREE, SLIDE):
            rate[body.topology.dof_joint == j] = 0.0
    return Dynamics(h, noise, jnp.asarray(rate), jnp.asarray(rest.q))


def _seen(body: Body, rest: RestEstimate, recording: Recording) -> np.ndarray:
    """Mask (nv,): degree of freedom moves something that is measured."""
    topology = body.topology
    names = [s.site for s in recording.setup.sensors if s.name in rest.sensors]
    names += list(recording.ranges.source_names) if recording.ranges is not None else []
    bodies = [topology.site_body[topology.site_index(n)] for n in {*names, *rest.sensors}
              if n in topology.site_names]  # fmt: skip
    return topology.body_dofs[bodies].any(axis=0) | topology.body_dofs[1]


def _remaining_mounting(rest: RestEstimate) -> float:
    """Typical error of the mounting rotations after the rest hold [rad]."""
    return float(np.sqrt(np.mean(rest.mounting_std**2))) if rest.mounting_std.size else 0.0


def jerk_density(body: Body, options: EkfOptions) -> np.ndarray:
    """Spectral density of the jerk of each degree of freedom (nv,) [rad^2/s^5, m^2/s^5]."""
    topology = body.topology
    joint = options.joint_jerk_density
    if options.process != "white_jerk":
        joint = options.paper_acceleration_noise**2 * _PAPER_RATE_HZ
    density = np.full(body.nv, joint)
    for j, kind in enumerate(topology.joint_types):
        at = topology.joint_dof[j]
        if kind == FREE:
            density[at : at + 3] = options.root_translation_jerk_density
            density[at + 3 : at + 6] = options.root_rotation_jerk_density
        elif kind == SLIDE and options.process == "white_jerk":
            density[at] = options.slide_jerk_density
    return density


def _start(body: Body, options: EkfOptions, rest: RestEstimate, seen: np.ndarray) -> State:
    """Belief at the first frame. What nothing measures stays where it is, uncertain."""
    still, nv = rest.still.still, body.nv
    sigma_v = options.rest_velocity_sigma if still else options.velocity_sigma
    sigma_a = options.rest_acceleration_sigma if still else options.acceleration_sigma
    P = np.zeros((3 * nv, 3 * nv))
    P[:nv, :nv] = rest.covariance
    pose, velocity, acceleration = np.arange(3 * nv).reshape(3, nv)
    P[velocity, velocity] = np.where(seen, sigma_v, 1e-3) ** 2
    P[acceleration, acceleration] = np.where(seen, sigma_a, 1e-3) ** 2
    P[pose[~seen], pose[~seen]] = options.joint_sigma**2
    return State(jnp.asarray(rest.q), jnp.zeros(nv), jnp.zeros(nv), jnp.asarray(P))


def run_filter(
    run: FilterRun, options: EkfOptions, progress: bool
) -> tuple[list[Estimates], dict[str, dict[str, float]], tuple[str, ...]]:
    """Filter (and smooth) all chunks: estimates, innovation statistics and remarks."""
    state, estimates, skipped = run.start, [], 0
    starts: list[State] = []
    beliefs: deque[State] = deque(maxlen=_kept_chunks(run))
    passes = 2 if options.smooth else 1
    bar = tqdm(total=passes * len(run.time), unit="frame", desc="ekf", disable=not progress)
    with bar:
        for frames in run.chunks:
            starts.append(state)
            state, chunk, innovations = filter_chunk(
                run.body, run.model, run.parameters, state, frames
            )
            if options.smooth:
                beliefs.append(chunk)
            else:
                estimates.append(_estimates(chunk, options.covariance))
            skipped += run.statistics.add(frames, innovations)
            bar.update(int(np.asarray(frames.valid).sum()))
        if options.smooth:
            estimates = _smooth(run, state, starts, beliefs, options.covariance, bar)
    remarks = (f"{skipped} updates were skipped because they were not finite.",) if skipped else ()
    return estimates, run.statistics.table(), remarks


def _kept_chunks(run: FilterRun) -> int:
    """How many chunks' beliefs are kept for the smoother; it filters earlier chunks again."""
    return max(1, int(_KEPT_BYTES / (len(run.chunks[0].valid) * run.start.covariance.nbytes)))


def _estimates(beliefs: State, covariance: bool) -> Estimates:
    """Filtered estimates of a chunk; copies, so that the full covariances can go."""
    nv = beliefs.v.shape[1]
    marginal = np.array(np.asarray(beliefs.covariance)[:, :nv, :nv]) if covariance else None
    return Estimates(np.asarray(beliefs.q), np.asarray(beliefs.v), marginal)


def _smooth(
    run: FilterRun, last: State, starts: list[State], kept: deque[State], covariance: bool,
    bar: tqdm,
) -> list[Estimates]:  # fmt: skip
    """Backward pass over the chunks, last first."""
    estimates, following = [], jnp.asarray(False)
    for start, frames in zip(reversed(starts), reversed(run.chunks), strict=True):
        if kept:
            beliefs = kept.pop()
        else:
            _, beliefs, _ = filter_chunk(run.body, run.model, run.parameters, start, frames)
        last, estimate = smooth_chunk(
            run.body.topology, run.model.process, run.parameters.dynamics, beliefs, frames.valid,
            last, following, covariance,
        )  # fmt: skip
        estimates.append(jax.tree.map(np.asarray, estimate))
        following = jnp.asarray(True)
        bar.update(int(np.asarray(frames.valid).sum()))
    return estimates[::-1]


def _status(q: np.ndarray, options: EkfOptions) -> Status:
    if not np.isfinite(q).all():
        return Status.DIVERGED
    return Status.SMOOTHED if options.smooth else Status.FILTERED


def _calibration(rest: RestEstimate) -> dict[str, dict[str, np.ndarray]]:
    values, deviations = {}, {}
    for i, name in enumerate(rest.sensors):
        for key, value, std in (
            ("gyroscope_bias", rest.gyroscope_bias, rest.gyroscope_bias_std),
            ("accelerometer_bias", rest.accelerometer_bias, rest.accelerometer_bias_std),
            ("mounting_rotation", rest.mounting_rotation, rest.mounting_std),
        ):
            values[f"{key}/{name}"], deviations[f"{key}/{name}"] = value[i], std[i]
    return {"calibration": values, "calibration_std": deviations}


def _option_record(options: EkfOptions) -> dict[str, object]:
    record = dataclasses.asdict(options)
    rest = record.pop("rest")
    return record | {f"rest_{key}": value for key, value in rest.items()}
