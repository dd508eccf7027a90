"""`range_only_path`: a whole path at once from odometry and ranges to known anchors."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax import linalg
from mocap_jax.errors import InputError
from mocap_jax.estimate.outcome_status import STATUS_OF
from mocap_jax.estimate.range_only.measurements import AnchorRanges, Odometry
from mocap_jax.estimate.range_only.options import RangeOnlyOptions
from mocap_jax.estimate.range_only.problem import PathProblem, PathState
from mocap_jax.least_squares import minimise
from mocap_jax.residuals import robust
from mocap_jax.solution import Status


@dataclass(frozen=True)
class RangeOnlySolution:
    """The path, and the constants found with it."""

    time: Float[np.ndarray, "t"]
    """Of the odometry [s]."""
    pose: Float[np.ndarray, "t 3"]
    """x [m], y [m], heading [rad]."""
    pose_std: Float[np.ndarray, "t 3"]
    """Standard deviations; NaN after a failed solve."""
    turn_bias: float
    """Excess of the measured turn rate [rad/s]."""
    scale: float
    """Relative excess of all ranges."""
    bias: Float[np.ndarray, "a"]
    """Constant excess of each anchor's ranges [m]."""
    constants_std: Float[np.ndarray, "m"]
    """Standard deviations of turn bias, scale and biases."""
    range_error: Float[np.ndarray, "r"]
    """Measured less predicted [m]."""
    weight: Float[np.ndarray, "r"]
    """How far each range was believed, 0 to 1."""
    status: Status
    cost: tuple[float, ...]
    """At the start and after each step."""
    seconds: float
    """Of the whole call."""


def range_only_path(
    odometry: Odometry,
    ranges: AnchorRanges,
    anchors: Float[np.ndarray, "a 2"],
    start: Float[np.ndarray, "3"],
    options: RangeOnlyOptions | None = None,
) -> RangeOnlySolution:
    """Estimate a path in the plane, with the constant errors of its measurements.

    Odometry that drifts far leads to a path from which a solver finds back late, or not at all.
    What makes it drift is mostly one number, the constant error of the turn rate: paths of many
    such errors are tried first, and the one whose ranges fit best is where the solver starts.

    Args:
        odometry: travelled distances and turns.
        ranges: to the anchors.
        anchors: their positions [m].
        start: rough first pose: x [m], y [m], heading [rad].
        options: see there.

    Raises:
        InputError: there are no ranges, or some are to anchors that are not there or of times
            without odometry; anchors or start of wrong shape.
    """
    begin = time.perf_counter()
    options = options or RangeOnlyOptions()
    anchors = np.asarray(anchors, np.float64)
    _check(odometry, ranges, anchors, start)
    problem = PathProblem(odometry, ranges, anchors, start, options)
    result = minimise(problem, first_state(problem), options.solver)
    state, status = result.state, STATUS_OF[result.outcome]
    pose_std, constants_std = _deviations(problem, state, status)
    error = problem.range_errors(state)
    return RangeOnlySolution(
        time=odometry.time, pose=state.pose, pose_std=pose_std,
        turn_bias=float(state.constants[0]), scale=float(state.constants[1]),
        bias=state.constants[2:], constants_std=constants_std,
        range_error=error * options.range_noise,
        weight=np.asarray(robust.weight(options.loss, error**2, options.loss_scale)),
        status=status, cost=result.cost, seconds=time.perf_counter() - begin,
    )  # fmt: skip


def _check(
    odometry: Odometry, ranges: AnchorRanges, anchors: np.ndarray, start: np.ndarray
) -> None:
    if anchors.ndim != 2 or anchors.shape[1] != 2 or not np.isfinite(anchors).all():
        raise InputError(f"anchors: must be positions (a, 2) [m], not of shape {anchors.shape}")
    if np.shape(start) != (3,) or not np.isfinite(start).all():
        raise InputError(f"start {start}: must be three numbers: x [m], y [m], heading [rad]")
    if not len(ranges.range):
        raise InputError("there are no ranges")
    strangers = ranges.anchor[(ranges.anchor < 0) | (ranges.anchor >= len(anchors))]
    if len(strangers):
        raise InputError(
            f"ranges name anchor {strangers[0]}; there are {len(anchors)}: 0 to {len(anchors) - 1}"
        )
    first, last = odometry.time[[0, -1]]
    outside = ranges.time[(ranges.time < first) | (ranges.time > last)]
    if len(outside):
        raise InputError(
            f"{len(outside)} of {len(ranges.time)} ranges are of times without odometry, as "
            f"{outside[0]:g} s; leave them out, valid: {first:g} to {last:g} s"
        )


def first_state(problem: PathProblem) -> PathState:
    """The dead-reckoned path whose ranges fit best, over errors of the turn rate."""
    o = problem.options
    none = np.zeros(len(problem.prior))
    reach = 3.0 * o.turn_bias_sigma
    states = [
        PathState(problem.dead_reckoned(bias), np.concatenate([[bias], none[1:]]))
        for bias in (np.linspace(-reach, reach, o.bias_starts) if reach else [0.0])
    ]
    return min(states, key=lambda state: float(np.abs(problem.range_errors(state)).mean()))


def _deviations(
    problem: PathProblem, state: PathState, status: Status
) -> tuple[np.ndarray, np.ndarray]:
    if not status.ok:
        return np.full_like(state.pose, np.nan), np.full_like(state.constants, np.nan)
    e = problem.linearise(state)
    factor = linalg.factor(e.lower, e.corner, e.border)
    variance = np.einsum("kaa->ka", linalg.marginals(factor, e.border))
    return np.sqrt(variance), np.sqrt(np.diag(linalg.corner_covariance(factor)))
