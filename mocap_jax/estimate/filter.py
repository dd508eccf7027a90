"""`ekf`: the extended Kalman filter of Vlasic 2007, section 5, and its backward smoother."""

from __future__ import annotations

import dataclasses
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future

import jax
import jax.numpy as jnp
import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from mocap_jax.body import Body
from mocap_jax.estimate.background import wait_for
from mocap_jax.estimate.compile_clock import CompileClock
from mocap_jax.estimate.filter_chunk import Estimates, filter_chunk, smooth_chunk
from mocap_jax.estimate.filter_compile import compile_filter
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.filter_run import FilterRun, prepare
from mocap_jax.estimate.gauge_remarks import gauge_remarks
from mocap_jax.estimate.inputs import (
    body_of,
    measures_orientation,
    mounting_remarks,
    uses_root,
)
from mocap_jax.estimate.magnetometers import stray_remarks
from mocap_jax.initialise import RestEstimate, rest_pose
from mocap_jax.kalman import SigmaPoints, State
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status
from mocap_jax.solution.methods import (
    FILTER,
    SMOOTHER,
    UNSCENTED_FILTER,
    UNSCENTED_SMOOTHER,
)
from mocap_jax.trajectory import Trajectory

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
    return run_ekf(recording, body, options, progress=progress)


def run_ekf(
    recording: Recording,
    body: Body | None,
    options: EkfOptions,
    *,
    progress: bool,
    meanwhile: Callable[[], object] = lambda: None,
    sigma_points: SigmaPoints | None = None,
) -> Solution:
    """`ekf`, or `ukf` with sigma points.

    `meanwhile` is called once the filter's own programs are queued for compilation.
    """
    clock = CompileClock()
    begin = time.perf_counter()
    # LAPACK of this size on more than one thread is many times slower on a busy machine.
    with clock, threadpool_limits(1, user_api="blas"):
        body = body_of(recording, body)
        use_root = uses_root(recording, options.root)
        programs = compile_filter(recording, body, options, use_root, sigma_points)
        meanwhile()
        rest = rest_pose(recording, body, options=options.rest, use_root=use_root)
        run = prepare(recording, body, options, rest, use_root, sigma_points)
        estimates, statistics, remarks = run_filter(run, options, progress, programs)
    q = np.concatenate([e.q for e in estimates])[: len(run.time)].astype(float)
    v = np.concatenate([e.v for e in estimates])[: len(run.time)].astype(float)
    covariance = None
    if options.covariance:
        covariance = np.concatenate([e.covariance for e in estimates])[: len(run.time)]
    pairs = None
    if options.pair_covariance:
        pairs = np.concatenate([e.pair for e in estimates])[: len(run.time) - 1]
    seconds = time.perf_counter() - begin
    oriented = "O" in options.kinds and measures_orientation(recording)
    return Solution(
        trajectory=Trajectory(np.asarray(run.time), q, v),
        body=body,
        status=_status(q, options),
        method=_method(options, sigma_points),
        setup=recording.setup,
        remarks=(
            *mounting_remarks(recording),
            *stray_remarks(recording, options.kinds),
            *rest.remarks,
            *remarks,
            *gauge_remarks(run.roots, kinds=options.kinds, oriented=oriented),
        ),
        covariance=covariance,
        pair_covariance=pairs,
        observed=run.observed,
        seconds_solve=seconds - clock.seconds,
        seconds_compile=clock.seconds,
        statistics=statistics,
        innovations=run.statistics.normalised,
        options=_option_record(options, sigma_points),
        **_calibration(rest),  # type: ignore[arg-type]
    )


def run_filter(
    run: FilterRun,
    options: EkfOptions,
    progress: bool,
    programs: Sequence[Future[None]] = (),
) -> tuple[list[Estimates], dict[str, dict[str, float]], tuple[str, ...]]:
    """Filter (and smooth) all chunks: estimates, innovation statistics and remarks.

    `programs` are being compiled: the filter's, then the smoother's.
    """
    state, estimates, skipped = run.start, [], 0
    starts: list[State] = []
    beliefs: deque[State] = deque(maxlen=_kept_chunks(run))
    passes = 2 if options.smooth else 1
    bar = tqdm(total=passes * len(run.time), unit="frame", desc=_name(run), disable=not progress)
    with bar:
        wait_for(programs[:1])
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
            wait_for(programs[1:])
            estimates = _smooth(run, state, starts, beliefs, options, bar)
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
    run: FilterRun, last: State, starts: list[State], kept: deque[State], options: EkfOptions,
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
            last, following, options.covariance, options.pair_covariance,
        )  # fmt: skip
        estimates.append(jax.tree.map(np.asarray, estimate))
        following = jnp.asarray(True)
        bar.update(int(np.asarray(frames.valid).sum()))
    return estimates[::-1]


def _name(run: FilterRun) -> str:
    return FILTER if run.model.sigma_points is None else UNSCENTED_FILTER


def _method(options: EkfOptions, sigma_points: SigmaPoints | None) -> str:
    if sigma_points is None:
        return SMOOTHER if options.smooth else FILTER
    return UNSCENTED_SMOOTHER if options.smooth else UNSCENTED_FILTER


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


def _option_record(options: EkfOptions, sigma_points: SigmaPoints | None) -> dict[str, object]:
    record = dataclasses.asdict(options)
    if sigma_points is not None:
        record |= {f"sigma_points_{k}": v for k, v in dataclasses.asdict(sigma_points).items()}
    rest = record.pop("rest")
    return record | {f"rest_{key}": value for key, value in rest.items()}
