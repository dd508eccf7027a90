"""The least-squares problem of one sensor: knots in time, sensor constants as the border.

Unknowns of a knot: rotation (world frame), velocity, position, gyroscope bias of the interval that
follows. Constants: `residuals.preintegration.CONSTANTS`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float

from mocap_jax import so3
from mocap_jax.estimate.single_imu.options import SingleImuOptions
from mocap_jax.least_squares import NormalEquations
from mocap_jax.residuals import preintegration
from mocap_jax.residuals.preintegration import Knot, Samples

WIDTH = 12
_TURN, _VELOCITY, _POSITION, _BIAS = (slice(3 * i, 3 * i + 3) for i in range(4))
# Heading and place of the whole are free: the first knot's heading is held to this [rad].
_HEADING = 1e-4
# Residuals of rotation and of translation are weighted apart.
_GROUPS = (slice(0, 3), slice(3, 9))
# Rounding and the trapezia of positions, beside the noise [m/s], [m].
_FLOOR = 1e-4

increments = jax.jit(jax.vmap(preintegration.preintegrate, (0, 0, None)))
_increment_slopes = jax.jit(jax.vmap(preintegration.increment_slopes, (0, 0, None)))
_residual_slopes = jax.jit(jax.vmap(preintegration.residual_slopes, (0, 0, 0, None, 0)))
_residuals = jax.jit(jax.vmap(preintegration.interval_residual, (0, 0, 0, None, 0)))


@dataclass(frozen=True)
class State:
    """Estimate of all unknowns."""

    knots: Knot
    """Of k + 1 knots."""
    bias: Float[np.ndarray, "k+1 3"]
    """Of the gyroscope [rad/s]."""
    constants: Float[np.ndarray, "15"]


class Rows(NamedTuple):
    """Whitened residuals that tie a knot to the next, and their derivatives."""

    value: Float[np.ndarray, "k n"]
    first: Float[np.ndarray, "k n 12"]
    second: Float[np.ndarray, "k n 12"]
    constants: Float[np.ndarray, "k n 15"]


class SingleImuProblem:
    """Fulfils `least_squares.Problem`."""

    refines = False
    bends = np.zeros(WIDTH)
    least_damping = 0.0

    def __init__(
        self, samples: Samples, still: Bool[np.ndarray, "k"], options: SingleImuOptions
    ) -> None:
        self.samples, self.still, self.options = samples, still, options
        self.duration = samples.step.sum(axis=1)
        self.gravity = np.array([0.0, 0.0, -options.gravity])
        self.prior = constant_deviations(options)
        self.whitening = interval_whitening(self.duration, options)
        self.knot_information = _knot_information(still, options)
        self.unknowns = (len(still) + 1) * WIDTH + len(self.prior)

    def cost(self, state: State) -> float:
        """Half the sum of squares, robust where the intervals are."""
        o, knots = self.options, state.knots
        increment, _ = increments(self.samples, state.bias[:-1], state.constants)
        raw = _residuals(*_pairs(knots), increment, self.gravity, self.duration)
        whitened = np.einsum("kab,kb->ka", self.whitening, np.asarray(raw))
        total = sum(_huber(_size(whitened[:, g]), o.robust_scale) for g in _GROUPS)
        soft = self._knot_values(state) ** 2 * self.knot_information
        walk = np.diff(state.bias, axis=0) ** 2 * self._walk_information[:, None]
        rest = _turns(knots.rotation) ** 2 * self._rest_information[:, None]
        constants = (state.constants / self.prior) ** 2
        return float((total + soft.sum() + walk.sum() + rest.sum() + constants.sum()) / 2)

    def linearise(self, state: State, follow: object = None) -> NormalEquations:
        """Normal equations, with the weights of the robust loss."""
        intervals = self._interval_rows(state)
        rows = [intervals, self._walk_rows(state), self._rest_rows(state)]
        knots = len(self.duration) + 1
        lower, gradient = np.zeros((knots, 2, WIDTH, WIDTH)), np.zeros((knots, WIDTH))
        for r in rows:
            lower[:-1, 0] += r.first.swapaxes(1, 2) @ r.first
            lower[1:, 0] += r.second.swapaxes(1, 2) @ r.second
            lower[:-1, 1] += r.second.swapaxes(1, 2) @ r.first
            gradient[:-1] += np.einsum("kna,kn->ka", r.first, r.value)
            gradient[1:] += np.einsum("kna,kn->ka", r.second, r.value)
        at = np.arange(WIDTH)
        lower[:, 0, at, at] += self.knot_information
        gradient += self.knot_information * self._knot_values(state)
        border = np.zeros((knots, len(self.prior), WIDTH))
        by_constants = intervals.constants.swapaxes(1, 2)
        border[:-1] += by_constants @ intervals.first
        border[1:] += by_constants @ intervals.second
        corner = (by_constants @ intervals.constants).sum(axis=0) + np.diag(self.prior**-2)
        slope = np.einsum("kna,kn->a", intervals.constants, intervals.value)
        slope += state.constants / self.prior**2
        return NormalEquations(
            self.cost(state), lower, gradient, corner, slope, lambda k: border[k]
        )

    def move(self, state: State, step: np.ndarray, constants: np.ndarray) -> State:
        """The state after a step."""
        knots = jax.tree.map(np.asarray, preintegration.retract_all(state.knots, step[:, :9]))
        return State(knots, state.bias + step[:, _BIAS], state.constants + constants)

    def model(self, *_: object, **__: object) -> tuple[np.ndarray, np.ndarray]:
        """Not asked for: steps are not refined."""
        raise NotImplementedError

    def _interval_rows(self, state: State) -> Rows:
        """Integrated samples, whitened and weighted."""
        increment, slopes = _increment_slopes(self.samples, state.bias[:-1], state.constants)
        value, by = _residual_slopes(*_pairs(state.knots), increment, self.gravity, self.duration)
        value = np.einsum("kab,kb->ka", self.whitening, np.asarray(value))
        by = self.whitening @ np.asarray(by)
        for group in _GROUPS:
            root = np.sqrt(_huber_weight(_size(value[:, group]), self.options.robust_scale))
            value[:, group] *= root[:, None]
            by[:, group] *= root[:, None, None]
        by_sensor = by[:, :, 18:] @ np.asarray(slopes)
        none = np.zeros((*value.shape, 3))
        first = np.concatenate([by[:, :, :9], by_sensor[:, :, :3]], axis=2)
        second = np.concatenate([by[:, :, 9:18], none], axis=2)
        return Rows(value, first, second, by_sensor[:, :, 3:])

    @property
    def _walk_information(self) -> np.ndarray:
        return 1 / (self.options.gyroscope_walk_sigma**2 * self.duration)

    @property
    def _rest_information(self) -> np.ndarray:
        return self.still / (self.options.still_turn**2 * self.duration)

    def _walk_rows(self, state: State) -> Rows:
        return _difference_rows(np.diff(state.bias, axis=0), self._walk_information, _BIAS)

    def _rest_rows(self, state: State) -> Rows:
        """A still sensor does not turn (world frame; the turn is small)."""
        return _difference_rows(_turns(state.knots.rotation), self._rest_information, _TURN)

    def _knot_values(self, state: State) -> Float[np.ndarray, "k+1 12"]:
        """What the priors of the knots hold near zero."""
        out = np.zeros((len(state.bias), WIDTH))
        out[:, _VELOCITY], out[:, _POSITION] = state.knots.velocity, state.knots.position
        out[:, _BIAS] = state.bias
        return out


def with_zero_motion(rotation: Float[np.ndarray, "k+1 3 3"], bias: np.ndarray) -> State:
    """A state at rest in the origin, with these orientations and this bias [rad/s]."""
    still = np.zeros((len(rotation), 3))
    return State(Knot(rotation, still, still), np.tile(bias, (len(rotation), 1)), np.zeros(15))


def constant_deviations(options: SingleImuOptions) -> Float[np.ndarray, "15"]:
    """Prior standard deviations of the constants."""
    o = options
    return np.repeat(
        [o.gyroscope_scale_sigma, o.accelerometer_bias_sigma, o.accelerometer_scale_sigma],
        [9, 3, 3],
    )


def interval_whitening(
    duration: Float[np.ndarray, "k"], options: SingleImuOptions
) -> Float[np.ndarray, "k 9 9"]:
    """Inverse roots of the covariances of the increments.

    White noise integrated once and twice: T, T^2/2, T^3/3 times its density.
    """
    covariance = np.zeros((len(duration), 2, 2))
    covariance[:, 0, 0], covariance[:, 1, 1] = duration, duration**3 / 3
    covariance[:, 0, 1] = covariance[:, 1, 0] = duration**2 / 2
    covariance = options.accelerometer_noise**2 * covariance + _FLOOR**2 * np.eye(2)
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    out, axes = np.zeros((len(duration), 9, 9)), np.arange(3)
    out[:, axes, axes] = (1 / (options.gyroscope_noise * np.sqrt(duration)))[:, None]
    out[:, 3:, 3:] = np.einsum("kij,ab->kiajb", root, np.eye(3)).reshape(-1, 6, 6)
    return out


def _knot_information(
    still: Bool[np.ndarray, "k"], options: SingleImuOptions
) -> Float[np.ndarray, "k+1 12"]:
    """Information of the priors: heading and bias at the start, bounded place and speed."""
    out = np.zeros((len(still) + 1, WIDTH))
    beside = np.concatenate([still, [False]]) | np.concatenate([[False], still])
    out[:, _POSITION] = options.reach**-2
    out[:, _VELOCITY] = np.where(beside, options.still_speed, options.speed)[:, None] ** -2.0
    out[0, 2] = _HEADING**-2
    out[0, _BIAS] = options.gyroscope_bias_sigma**-2
    return out


def _difference_rows(
    value: Float[np.ndarray, "k 3"], information: Float[np.ndarray, "k"], at: slice
) -> Rows:
    root = np.sqrt(information)[:, None]
    first = np.zeros((len(value), 3, WIDTH))
    first[:, :, at] = -np.eye(3) * root[:, :, None]
    return Rows(value * root, first, -first, np.zeros((len(value), 3, 0)))


def _pairs(knots: Knot) -> tuple[Knot, Knot]:
    """The knots before and after every interval."""
    return Knot(*(x[:-1] for x in knots)), Knot(*(x[1:] for x in knots))


def _turns(rotation: Float[np.ndarray, "k+1 3 3"]) -> Float[np.ndarray, "k 3"]:
    """Rotation vectors from knot to knot [rad], world frame."""
    return np.asarray(so3.log(so3.matmul3(rotation[1:], np.swapaxes(rotation[:-1], 1, 2))))


def _size(whitened: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k"]:
    return np.linalg.norm(whitened, axis=1)


def _huber(size: np.ndarray, scale: float) -> float:
    """Sum of the loss of whitened norms; the scale is per component, here of three."""
    limit = scale * np.sqrt(3)
    return float(np.where(size > limit, 2 * limit * size - limit**2, size**2).sum())


def _huber_weight(size: np.ndarray, scale: float) -> np.ndarray:
    limit = scale * np.sqrt(3)
    return limit / np.maximum(size, limit)
