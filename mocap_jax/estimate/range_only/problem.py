"""The least-squares problem of a path in the plane.

Unknowns of a time: x, y, heading. Constants, as the border: error of the turn rate, relative excess
of all ranges, and each anchor's constant excess. A range's place is interpolated between two times.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mocap_jax.estimate.range_only.measurements import AnchorRanges, Odometry
from mocap_jax.estimate.range_only.options import RangeOnlyOptions
from mocap_jax.least_squares import NormalEquations
from mocap_jax.residuals import robust

_HELD = 1e-9
"""Deviation of constants that are held at 0: far below anything that matters."""
_AT_THE_ANCHOR = 1e-6
"""Nearer than this [m] a range has no direction."""


class PathState(NamedTuple):
    """Estimate of all unknowns."""

    pose: Float[np.ndarray, "t 3"]
    """x [m], y [m], heading [rad]."""
    constants: Float[np.ndarray, "m"]
    """Turn rate [rad/s], scale [1], bias of each anchor [m]."""


@dataclass(frozen=True)
class Rows:
    """Whitened residuals of steps or of ranges, with their derivatives."""

    value: Float[np.ndarray, "k n"]
    index: np.ndarray
    """Earlier one of the two times that each row group depends on (k,)."""
    first: Float[np.ndarray, "k n 3"]
    second: Float[np.ndarray, "k n 3"]
    constants: Float[np.ndarray, "k n m"]


class PathProblem:
    """Fulfils `least_squares.Problem`."""

    refines = False
    bends = np.zeros(3)
    least_damping = 0.0

    def __init__(
        self,
        odometry: Odometry,
        ranges: AnchorRanges,
        anchors: Float[np.ndarray, "a 2"],
        start: Float[np.ndarray, "3"],
        options: RangeOnlyOptions,
    ) -> None:
        self.odometry, self.ranges, self.anchors = odometry, ranges, anchors
        self.options, self.start = options, np.asarray(start, np.float64)
        o = options
        self.step = np.diff(odometry.time)
        self._root = 1.0 / (
            np.sqrt(self.step)[:, None] * [o.forward_noise, o.sideways_noise, o.turn_noise]
        )
        place = np.searchsorted(odometry.time, ranges.time, "right") - 1
        self._before = np.clip(place, 0, len(self.step) - 1)
        # `range_only_path` refuses ranges before the first time and after the last.
        self._share = (ranges.time - odometry.time[self._before]) / self.step[self._before]
        sigma = [o.turn_bias_sigma, o.scale_sigma, *[o.bias_sigma] * len(anchors)]
        self.prior = np.maximum(sigma, _HELD)
        self._start_root = 1.0 / np.array([o.start_sigma[0]] * 2 + [o.start_sigma[1]])
        self.unknowns = 3 * len(odometry.time) + len(self.prior)

    def cost(self, state: PathState) -> float:
        """Half the sum of squares, of ranges their robust loss."""
        steps = self._steps(state).value
        first = (state.pose[0] - self.start) * self._start_root
        prior = state.constants / self.prior
        loss = robust.loss(self.options.loss, self.range_errors(state) ** 2,
                           self.options.loss_scale)  # fmt: skip
        total = (steps**2).sum() + (first**2).sum() + (prior**2).sum() + np.asarray(loss).sum()
        return float(total) / 2

    def linearise(self, state: PathState, follow: object = None) -> NormalEquations:
        """Normal equations, with the weights of the robust loss."""
        times, count = len(state.pose), len(self.prior)
        lower, gradient = np.zeros((times, 2, 3, 3)), np.zeros((times, 3))
        border = np.zeros((times, count, 3))
        corner, slope = np.diag(self.prior**-2), state.constants / self.prior**2
        for rows in (self._steps(state), self._ranges(state)):
            _add(rows, lower, gradient, border)
            corner = corner + np.einsum("kna,knb->ab", rows.constants, rows.constants)
            slope = slope + np.einsum("kna,kn->a", rows.constants, rows.value)
        at = np.arange(3)
        lower[0, 0, at, at] += self._start_root**2
        gradient[0] += (state.pose[0] - self.start) * self._start_root**2
        return NormalEquations(
            self.cost(state), lower, gradient, corner, slope, lambda k: border[k]
        )

    def move(self, state: PathState, step: np.ndarray, constants: np.ndarray) -> PathState:
        """The state after a step."""
        return PathState(state.pose + step, state.constants + constants)

    def model(self, *_: object, **__: object) -> tuple[np.ndarray, np.ndarray]:
        """Not asked for: steps are not refined."""
        raise NotImplementedError

    def range_errors(self, state: PathState) -> Float[np.ndarray, "r"]:
        """Measured less predicted ranges, in deviations."""
        away = np.linalg.norm(self._places(state) - self.anchors[self.ranges.anchor], axis=1)
        predicted = away * (1.0 + state.constants[1]) + state.constants[2 + self.ranges.anchor]
        return (self.ranges.range - predicted) / self.options.range_noise

    def dead_reckoned(self, turn_bias: float) -> Float[np.ndarray, "t 3"]:
        """The path that the steps alone lead to, with this error of the turn rate [rad/s]."""
        turn = self.odometry.turn - turn_bias * self.step
        heading = self.start[2] + np.concatenate([[0.0], np.cumsum(turn)])
        middle = heading[:-1] + 0.5 * turn
        way = self.odometry.distance[:, None] * np.stack([np.cos(middle), np.sin(middle)], axis=1)
        position = self.start[:2] + np.concatenate([np.zeros((1, 2)), np.cumsum(way, axis=0)])
        return np.concatenate([position, heading[:, None]], axis=1)

    def _places(self, state: PathState) -> Float[np.ndarray, "r 2"]:
        before, after = state.pose[self._before, :2], state.pose[self._before + 1, :2]
        return before + self._share[:, None] * (after - before)

    def _steps(self, state: PathState) -> Rows:
        """Steps against odometry; the way of a step points along its mean heading."""
        pose, count = state.pose, len(self.prior)
        middle = 0.5 * (pose[:-1, 2] + pose[1:, 2])
        c, s = np.cos(middle), np.sin(middle)
        dx, dy = np.diff(pose[:, :2], axis=0).T
        along, across = c * dx + s * dy, c * dy - s * dx
        turned = np.diff(pose[:, 2]) - self.odometry.turn + state.constants[0] * self.step
        value = np.stack([along - self.odometry.distance, across, turned], axis=1)
        second = np.zeros((len(c), 3, 3))
        second[:, 0], second[:, 1] = (
            np.stack(x, axis=1) for x in ((c, s, across / 2), (-s, c, -along / 2))
        )
        first = -second
        first[:, :2, 2] = second[:, :2, 2]
        first[:, 2, 2], second[:, 2, 2] = -1.0, 1.0
        constants = np.zeros((len(c), 3, count))
        constants[:, 2, 0] = self.step
        root = self._root
        return Rows(
            value * root, np.arange(len(c)), first * root[:, :, None], second * root[:, :, None],
            constants * root[:, :, None],
        )  # fmt: skip

    def _ranges(self, state: PathState) -> Rows:
        """Ranges, each weighted by its robust loss."""
        o, anchor = self.options, self.ranges.anchor
        error = self.range_errors(state)
        weight = robust.weight(o.loss, error**2, o.loss_scale)
        root = np.sqrt(np.asarray(weight)) / o.range_noise
        apart = self._places(state) - self.anchors[anchor]
        away = np.maximum(np.linalg.norm(apart, axis=1), _AT_THE_ANCHOR)
        towards = -(1.0 + state.constants[1]) * apart / away[:, None] * root[:, None]
        first, second = np.zeros((len(away), 1, 3)), np.zeros((len(away), 1, 3))
        first[:, 0, :2] = towards * (1.0 - self._share)[:, None]
        second[:, 0, :2] = towards * self._share[:, None]
        constants = np.zeros((len(away), 1, len(self.prior)))
        constants[:, 0, 1] = -away * root
        constants[np.arange(len(away)), 0, 2 + anchor] = -root
        value = error * root * o.range_noise
        return Rows(value[:, None], self._before, first, second, constants)


def _add(rows: Rows, lower: np.ndarray, gradient: np.ndarray, border: np.ndarray) -> None:
    """Add squares and slopes of rows to the equations, in place."""
    at = rows.index
    turned = rows.second.swapaxes(1, 2)
    np.add.at(lower[:, 0], at, rows.first.swapaxes(1, 2) @ rows.first)
    np.add.at(lower[:, 0], at + 1, turned @ rows.second)
    np.add.at(lower[:, 1], at, turned @ rows.first)
    np.add.at(gradient, at, np.einsum("kna,kn->ka", rows.first, rows.value))
    np.add.at(gradient, at + 1, np.einsum("kna,kn->ka", rows.second, rows.value))
    by_constants = rows.constants.swapaxes(1, 2)
    np.add.at(border, at, by_constants @ rows.first)
    np.add.at(border, at + 1, by_constants @ rows.second)
