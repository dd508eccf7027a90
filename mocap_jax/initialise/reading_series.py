"""Readings of one sensor on an even, slower grid: what convention checks look at."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mocap_jax.recording import InertialStream

# Readings are averaged to this [Hz], over at most so much of the recording [s].
_RATE_HZ, _LONGEST = 25.0, 240.0
_WINDOW = 1.0
# A window rests when its specific force varies by less than this share of its median norm.
_REST = 0.02
# At rest a board turns so little, as a share of the mean square of its rate over the recording, and
# not more than so many times as much as in the quietest of its windows: feet and shanks that turn
# steadily about the vertical feel an even force, too.
_TURNING, _QUIETEST = 0.04, 4.0
# Free accelerations come near zero time and again, specific forces do not: 5 % quantile of the
# norm, as a share of the median.
_FREE = 0.3
# Gravity may be off by this factor where no rest shows it: feet that land feel more.
_MOVING = 1.7
STANDARD_GRAVITY = 9.80665
"""[m/s^2]"""


class Series(NamedTuple):
    """One sensor's means over steps of an even grid; NaN where something is missing."""

    step: float
    """[s]"""
    force: Float[np.ndarray, "n 3"]
    rate: Float[np.ndarray, "n 3"]
    orientation: Float[np.ndarray, "m 4"]
    """At the edges of the steps (wxyz): m = n + 1."""

    @property
    def window(self) -> int:
        """Steps in a window of a second."""
        return max(int(round(_WINDOW / self.step)), 1)


def series_of(stream: InertialStream) -> Series:
    """Average a stream's readings, and take its orientation at the edges of the steps."""
    time = np.asarray(stream.time, float)
    step = max(1.0 / _RATE_HZ, float(np.median(np.diff(time))) if len(time) > 1 else 1.0)
    span = min(time[-1] - time[0], _LONGEST) if len(time) else 0.0
    edges = time[0] + np.arange(int(span / step) + 1) * step if len(time) else np.zeros(1)
    near = np.clip(np.searchsorted(time, edges - 1e-9), 0, max(len(time) - 1, 0))
    return Series(
        step,
        _means(np.asarray(stream.accelerometer, float), near),
        _means(np.asarray(stream.gyroscope, float), near),
        np.asarray(stream.orientation, float)[near] if len(time) else np.full((1, 4), np.nan),
    )


def rest_force(
    series: Series, gravity: float = STANDARD_GRAVITY
) -> tuple[Float[np.ndarray, "3"], int | None]:
    """Mean specific force at rest and the step at which the rest ends.

    Without a rest the step is None, and the force is one of the size that gravity seems to have:
    NaN where the median norm is near what is expected, so that nothing is said about it.
    """
    force, window = series.force, series.window
    norm = np.linalg.norm(force, axis=1)
    if np.isfinite(norm).sum() < 2 * window:
        return np.full(3, np.nan), None
    median = float(np.nanmedian(norm))
    low = float(np.nanquantile(norm, 0.05))
    if low < _FREE * median:
        return np.array([0.0, 0.0, 0.3 * low]), None
    mean, spread = _window_moments(force, window)
    still = _turning_least(series.rate, window, np.flatnonzero(spread < _REST * median))
    if still.size:
        return mean[still[0]], int(still[0]) + window
    usual = gravity / _MOVING < median < gravity * _MOVING
    return np.array([0.0, 0.0, np.nan if usual else median]), None


def _turning_least(
    rate: Float[np.ndarray, "n 3"], window: int, still: np.ndarray
) -> Float[np.ndarray, "m"]:
    """Those of the windows of even force in which the board turns least; none if it turns in all.

    Whatever the rates' unit and offset; a recording that is still for the most part rests.
    """
    if not still.size or not np.isfinite(rate).any():
        return still
    turning = ((rate - np.nanmedian(rate, axis=0)) ** 2).sum(axis=1)
    each = np.lib.stride_tricks.sliding_window_view(turning, window).mean(axis=-1)[still]
    each = np.where(np.isfinite(each), each, np.inf)
    moves = 2 * still.size < len(rate) and each.min() > _TURNING * np.nanmean(turning)
    return still[:0] if moves else still[each <= _QUIETEST * each.min()]


def _window_moments(values: np.ndarray, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean and spread (root of the summed variances) of every window; NaN where data miss."""
    views = np.lib.stride_tricks.sliding_window_view(values, window, axis=0)
    return views.mean(axis=-1), np.sqrt(views.var(axis=-1).sum(axis=1))


def _means(values: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Means between the samples at the edges; NaN where any value misses."""
    if len(near) < 2:
        return np.zeros((0, values.shape[1]))
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(np.nan_to_num(values), 0)])
    holes = np.concatenate([[0], np.cumsum(~np.isfinite(values).all(axis=1))])
    first, last = near[:-1], near[1:]
    count = np.maximum(last - first, 1)[:, None]
    bad = (holes[last] - holes[first] > 0) | (last == first)
    return np.where(bad[:, None], np.nan, (total[last] - total[first]) / count)
