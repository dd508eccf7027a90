"""`optimise`: all poses of a recording at once, by Levenberg-Marquardt."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from concurrent.futures import Future

import numpy as np

from mocap_jax.body import Body
from mocap_jax.errors import InputError, SolveError
from mocap_jax.estimate.background import wait_for
from mocap_jax.estimate.compile_clock import CompileClock
from mocap_jax.estimate.constant_names import constants_from
from mocap_jax.estimate.initial_guess import at_rest, first_guess, on_grid
from mocap_jax.estimate.inputs import body_of, measures_orientation, uses_root
from mocap_jax.estimate.magnetometers import sequence_readings
from mocap_jax.estimate.orientation_options import OrientationPassOptions
from mocap_jax.estimate.orientation_pass import orientation_pass
from mocap_jax.estimate.rest_tilt import gather_with_rest
from mocap_jax.estimate.sequence.compile_ahead import compile_ahead
from mocap_jax.estimate.sequence.problem import State
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.estimate.skin import displaced, on_skin, without_skin
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.estimate.whole_sequence_run import Run
from mocap_jax.initialise import declared_pose
from mocap_jax.measurement import FrameData, gather
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution


def optimise(
    recording: Recording,
    body: Body | None = None,
    *,
    initial: Solution | None = None,
    options: OptimiseOptions = OptimiseOptions(),  # noqa: B008  (frozen)
    user_data: tuple = (),
    progress: bool = False,
    throw: bool = False,
) -> Solution:
    """Estimate a whole motion at once: the poses that explain all measurements best.

    Args:
        recording: measured streams and their set-up.
        body: nominal body whose sites carry the sensors; default the recording's own. It is given
            a free root if it has none.
        initial: where to start (any earlier solution); default as `options.initial` says.
        options: see `OptimiseOptions`.
        user_data: for each of `options.user_residuals` a pytree of arrays with one row a frame.
        progress: show a progress bar (stderr).
        throw: raise `SolveError` instead of returning a failed solution.

    Returns:
        Poses, their covariances, the sensors' constants and residual statistics. A failed solve
        is a value whose status says so.

    Raises:
        InputError: no body, unknown sensors, or `root="given"` without a measured root.
    """
    return solve_sequence(
        recording, body, initial=initial, options=options, user_data=user_data,
        progress=progress, throw=throw,
    )[0]  # fmt: skip


def solve_sequence(
    recording: Recording,
    body: Body | None = None,
    *,
    initial: Solution | None = None,
    options: OptimiseOptions = OptimiseOptions(),  # noqa: B008  (frozen)
    user_data: tuple = (),
    progress: bool = False,
    throw: bool = False,
) -> tuple[Solution, Run]:
    """`optimise`, with the problem behind its solution."""
    clock, begin = CompileClock(), time.perf_counter()
    with clock:
        own = body = body_of(recording, body)
        if options.prior.skin_sigma > 0:
            body = on_skin(own, recording)
        root_given = uses_root(recording, options.root)
        data = gather_with_rest(recording, body, options, root=root_given)
        magnetic = sequence_readings(
            recording, own, options, np.asarray(data.time), root_given=root_given
        )
        built = build(
            data, body, recording.setup, options, root_given=root_given, user_data=user_data,
            inertial=_all_inertial(recording, body, options), magnetic=magnetic,
        )  # fmt: skip
        run = Run(recording, body, data, built, options)
        if initial is None:
            programs: list[Future[None]] = []
            queue = lambda: programs.extend(compile_ahead(run.problem))  # noqa: E731
            initial = _initial(recording, own, options, progress=progress, meanwhile=queue)
            wait_for(programs)
        constants = constants_from(initial, data.sensors, built.layout, built.walk)
        state = State(displaced(on_grid(initial, own, data.time), body), constants)
        solution = run.solve(state, recording, root_given=root_given, progress=progress)
        if body is not own:
            solution = without_skin(solution, own, data)
        solution = dataclasses.replace(solution, remarks=(*solution.remarks, *built.remarks))
    seconds = time.perf_counter() - begin
    solution = dataclasses.replace(
        solution, seconds_solve=seconds - clock.seconds, seconds_compile=clock.seconds
    )
    if throw and not solution.status.ok:
        raise SolveError(solution.status.value)
    return solution, run


def _all_inertial(recording: Recording, body: Body, options: OptimiseOptions) -> FrameData | None:
    """What the gravity reference reads, whatever the kinds chosen; None without one."""
    if options.gravity is None:
        return None
    return gather(recording, body, kinds="AG", root=False, rate_hz=options.rate_hz)


def _initial(
    recording: Recording, body: Body, options: OptimiseOptions, *, progress: bool,
    meanwhile: Callable[[], object],
) -> Solution:  # fmt: skip
    """The initial guess that the options name; `meanwhile` queues work for the background."""
    if options.initial == "orientation":
        return _orientation_pass(recording, body, options, progress=progress, meanwhile=meanwhile)
    return first_guess(recording, body, options, progress=progress, meanwhile=meanwhile)


def _orientation_pass(
    recording: Recording, body: Body, options: OptimiseOptions, *, progress: bool,
    meanwhile: Callable[[], object],
) -> Solution:  # fmt: skip
    """Poses from orientations: frame by frame with the pose prior, or else the whole sequence.

    Frame by frame, each started from the last, no frame ends a turn away from where it should be
    (von Marcard 2017, section 4.5). The whole sequence takes rates and gravity at rest as well, and
    starts from the rest pose.
    """
    kinds = "".join(k for k in "GO" if k in options.kinds)
    if not kinds:
        raise InputError(
            f"initial='orientation' needs rates or orientations, but kinds are '{options.kinds}'; "
            "valid: ekf, ekf_smoothed"
        )
    meanwhile()
    if options.pose_prior is not None and "O" in kinds and measures_orientation(recording):
        return orientation_pass(
            recording, body, start=declared_pose(recording.setup.rest, body), progress=progress,
            options=OrientationPassOptions(
                pose_prior=options.pose_prior, warm_start=True, rate_hz=options.rate_hz,
                root=options.root, share_sigma=options.prior.share_sigma,
            ),
        )  # fmt: skip
    still = at_rest(recording, body, use_root=uses_root(recording, options.root))
    first = dataclasses.replace(
        options, kinds=kinds, covariance=False, user_residuals=(), contacts=None,
        prior=dataclasses.replace(options.prior, skin_sigma=0.0),
        noise=dataclasses.replace(options.noise, adapt=False),
        constants=dataclasses.replace(options.constants, adapt=False),
    )  # fmt: skip
    return optimise(recording, body, initial=still, options=first, progress=progress)
