"""`smooth_orientation`: one inertial sensor's orientation from its whole recording at once."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass

import jax
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from mocap_jax import linalg, so3
from mocap_jax.errors import InputError
from mocap_jax.estimate.outcome_status import STATUS_OF
from mocap_jax.estimate.single_imu.intervals import checked, cut, still_bias, still_intervals
from mocap_jax.estimate.single_imu.options import SingleImuOptions
from mocap_jax.estimate.single_imu.problem import (
    SingleImuProblem,
    State,
    increments,
    with_zero_motion,
)
from mocap_jax.estimate.single_imu.start import first_orientations
from mocap_jax.estimate.single_imu.suspicions import suspicions
from mocap_jax.least_squares import Outcome, Result, minimise
from mocap_jax.recording import InertialStream
from mocap_jax.residuals.preintegration import CONSTANTS
from mocap_jax.solution import Status

_log_all = jax.jit(jax.vmap(so3.log))


@dataclass(frozen=True)
class SingleImuSolution:
    """Orientation of one sensor, and what was found with it."""

    time: Float[np.ndarray, "n"]
    """End of every sample's interval [s]: half a step after its stamp."""
    quaternion: Float[np.ndarray, "n 4"]
    """R_world_sensor (wxyz) then; Z up; the zero of the heading is arbitrary."""
    knot_time: Float[np.ndarray, "k"]
    """[s]"""
    orientation_std: Float[np.ndarray, "k 3"]
    """Standard deviation of the orientation about the world's axes [rad]; the third is the drift of
    heading since the start. NaN after a failed solve, or one that found nothing better than the
    start."""
    gyroscope_bias: Float[np.ndarray, "k 3"]
    """[rad/s]"""
    calibration: dict[str, np.ndarray]
    """Relative errors of the gyroscope (3, 3), bias [m/s^2] and relative scale (3) of the
    accelerometer: measured = (1 + error) true + bias to first order."""
    calibration_std: dict[str, np.ndarray]
    """Their standard deviations."""
    still: Bool[np.ndarray, "k-1"]
    """Intervals taken for still."""
    status: Status
    cost: tuple[float, ...]
    """At the start and after each step that was kept: never higher at the end than at the start."""
    seconds: float
    """Of the whole call."""
    remarks: tuple[str, ...] = ()
    """Sentences for the user: readings that look wrong, steps that led nowhere."""


def smooth_orientation(
    stream: InertialStream, options: SingleImuOptions | None = None
) -> SingleImuSolution:
    """Orientation of a hand-held or body-worn sensor from rates and specific forces alone.

    Samples between knots are integrated; orientations, velocities, positions and biases at all
    knots and the sensor's constants are found together. Tilt is known because a hand stays within
    reach: a wrong tilt turns gravity into an acceleration that leads away. Heading is what the
    rates say once their errors are known; its zero is arbitrary.

    Args:
        stream: one sensor's samples at equal distances in time.
        options: see there.

    Readings in other units are refused where their size gives them away, and told in the remarks
    and as a warning where only their disagreement does (`initialise.check_readings`).

    Raises:
        InputError: too short, not uniform, gaps in the samples, or wrong units.
    """
    options = options or SingleImuOptions()
    begin = time.perf_counter()
    rate, force, step = checked(stream)
    remarks = suspicions(stream)
    for text in remarks:
        warnings.warn(text, UserWarning, stacklevel=2)
    count = max(int(round(options.interval / step)), 1)
    if len(rate) < 2 * count:
        raise InputError(
            f"an inertial stream of {len(rate) * step:.2f} s: needs at least two intervals of "
            f"{options.interval} s"
        )
    samples = cut(rate, force, step, count)
    still = still_intervals(samples, options)
    bias = still_bias(samples, still)
    state = with_zero_motion(np.empty((0, 3, 3)), bias)
    increment, _ = increments(samples, np.tile(bias, (len(still), 1)), state.constants)
    duration = samples.step.sum(axis=1)
    state = with_zero_motion(first_orientations(increment, duration), bias)
    problem = SingleImuProblem(samples, still, options)
    result, told = _no_worse(minimise(problem, state, options.solver), state)
    status = STATUS_OF[result.outcome]
    # About a start that is no minimum, deviations mean nothing.
    orientation_std, constants_std = _deviations(problem, result.state, status.ok and not told)
    return SingleImuSolution(
        time=np.asarray(stream.time) + step / 2,
        quaternion=_at_samples(problem, result.state)[: len(rate)],
        knot_time=np.asarray(stream.time)[0] - step / 2 + np.concatenate([[0], duration.cumsum()]),
        orientation_std=orientation_std,
        gyroscope_bias=result.state.bias,
        calibration=_named(result.state.constants),
        calibration_std=_named(constants_std),
        still=still,
        status=status,
        cost=result.cost,
        seconds=time.perf_counter() - begin,
        remarks=(*remarks, *told),
    )


def _no_worse(result: Result, start: State) -> tuple[Result, tuple[str, ...]]:
    """The result, or the start where Gauss-Newton ended higher, with a remark."""
    first, last = result.cost[0], result.cost[-1]
    if last <= first:
        return result, ()
    told = (
        f"The steps led from a cost of {first:.4g} to one of {last:.4g}: the start is returned, "
        "integrated rates whose tilt follows the mean specific force. Check the units, or damp the "
        "steps (SingleImuOptions.solver with initial_damping=None).",
    )
    return Result(start, Outcome.STALLED, (first,), result.message), told


def _deviations(
    problem: SingleImuProblem, state: State, known: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations of the knots' orientations (k, 3) and of the constants (15,)."""
    if not known:
        return np.full((len(state.bias), 3), np.nan), np.full(len(state.constants), np.nan)
    e = problem.linearise(state)
    factor = linalg.factor(e.lower, e.corner, e.border)
    variances = np.einsum("kaa->ka", linalg.marginals(factor, e.border))[:, :3]
    return np.sqrt(variances), np.sqrt(np.diag(linalg.corner_covariance(factor)))


def _at_samples(problem: SingleImuProblem, state: State) -> Float[np.ndarray, "m 4"]:
    """Orientations after every sample: integrated from each knot, so that the next is met."""
    increment, within = increments(problem.samples, state.bias[:-1], state.constants)
    first, second = state.knots.rotation[:-1], state.knots.rotation[1:]
    met = so3.matmul3(np.swapaxes(first, 1, 2), second)
    missed = _log_all(so3.matmul3(np.swapaxes(increment.rotation, 1, 2), met))
    share = problem.samples.step.cumsum(axis=1) / problem.duration[:, None]
    closing = so3.exp(share[..., None] * missed[:, None])
    return np.asarray(_quaternions(so3.matmul3(first[:, None], so3.matmul3(within, closing))))


@jax.jit
def _quaternions(rotation: Float[Array, "k n 3 3"]) -> Float[Array, "m 4"]:
    return so3.quat_normalise(so3.quat_from_matrix(rotation).reshape(-1, 4))


def _named(constants: Float[np.ndarray, "15"]) -> dict[str, np.ndarray]:
    """Constants by name, in their shapes."""
    sizes = [int(np.prod(shape)) for shape in CONSTANTS.values()]
    parts = np.split(constants, np.cumsum(sizes)[:-1])
    return {name: x.reshape(CONSTANTS[name]) for name, x in zip(CONSTANTS, parts, strict=True)}
