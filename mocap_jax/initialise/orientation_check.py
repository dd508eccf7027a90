"""Whether measured orientations fit the same sensor's accelerometer and gyroscope.

A segment accelerates little in the mean: its specific force, turned into the world by the measured
orientation and averaged over seconds, is gravity and points up. Its angular velocity from
differences of orientations is the gyroscope's. Quaternions of another order or direction, worlds
with another axis up, and reversed accelerometers break this, each in its own way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.initialise.reading_series import Series
from mocap_jax.initialise.sensor_units import rate_factor_near

_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
_READINGS = {
    "": lambda q: q,
    "quaternions look like xyzw, read as wxyz": lambda q: np.roll(q, 1, axis=1),
    "quaternions look like wxyz, read as xyzw": lambda q: np.roll(q, -1, axis=1),
    "orientations look like world-to-sensor, read as sensor-to-world": lambda q: q * _CONJUGATE,
    "quaternions look like xyzw and world-to-sensor, read as wxyz and sensor-to-world": lambda q: (
        np.roll(q, 1, axis=1) * _CONJUGATE
    ),
    "quaternions look like wxyz and world-to-sensor, read as xyzw and sensor-to-world": lambda q: (
        np.roll(q * _CONJUGATE, -1, axis=1)
    ),
}
"""What may be wrong with quaternions, and what the right ones are then."""
_AXES = np.concatenate([np.eye(3)[::-1], -np.eye(3)[::-1]])
_AXIS_NAMES = ("z", "y", "x", "-z", "-y", "-x")
# Misfits below these are normal: of gravity, as a share of it, and of rates (1 - correlation).
_GRAVITY, _RATE = 0.35, 0.3
# Of both together, as a sum of squares of their shares of these.
_BAD = 1.5
# Another reading must leave less than this share of the misfit.
_DECISIVE = 0.35
# Of readings that fit alike, up to this factor, the simplest is named.
_ALIKE = 1.5
# Windows of a second, at least.
_LEAST = 1.5
# Turning less than this tells nothing about rates [rad/s].
_TURNING = 0.15
# Rates are compared as means over this time, in which errors of orientations of a degree make a
# tenth of a radian per second instead of a whole one [s].
_SMOOTH = 0.2


class Fit(NamedTuple):
    """How well readings of one sensor's orientations fit: rows as in `_READINGS`."""

    gravity: np.ndarray
    """Misfit with each axis up (readings, axes), as a share of what is felt."""
    rate: np.ndarray
    """1 - |correlation| of rates (readings,); 0 where there is nothing to compare."""
    slope: float
    """What the gyroscope is to be multiplied by to give the rate of turning; NaN: unknown."""
    tilt: float
    """Angle of the mean force from up, as read [rad]."""

    @property
    def cost(self) -> np.ndarray:
        """Of every reading and axis."""
        return (self.gravity / _GRAVITY) ** 2 + (self.rate[:, None] / _RATE) ** 2


def orientation_faults(series: dict[str, Series]) -> dict[str, list[str]]:
    """What is wrong with each sensor's orientations; sensors without any are left out.

    A wrong convention is one of the whole file: the reading that fits all sensors best is named for
    those that it explains decisively better.
    """
    fits = {name: fit for name, s in series.items() if (fit := _fit(s)) is not None}
    if not fits:
        return {}
    cost = np.stack([f.cost for f in fits.values()])
    bad = cost[:, 0, 0] > _BAD
    out: dict[str, list[str]] = {name: [] for name in fits}
    misread = False
    if bad.any():
        pooled = np.log(cost[bad] + 0.05).mean(axis=0)
        best = np.unravel_index(int(np.argmin(pooled)), pooled.shape)
        for name, c, wrong in zip(fits, cost, bad, strict=True):
            if wrong:
                named = c[best] < _DECISIVE * c[0, 0]
                misread |= bool(named and best[0])
                out[name].append(_sentence(*best) if named else _unfit(fits[name]))
    # Rates of turning of a misread file are those of no sensor.
    for name, fit in fits.items() if not misread else ():
        if not out[name] and (text := rate_factor_near(fit.slope)) is not None:
            out[name].append(f"gyroscope {text} (compared with its orientations)")
    return out


def misread_orders(series: dict[str, Series]) -> dict[str, str]:
    """Order or direction of quaternions that fits decisively better, and well, in a world of z up.

    Orientations that fit badly for another reason (a disturbed compass, a slipped strap) are left
    out: they are no matter of reading a file.
    """
    fits = {name: fit for name, s in series.items() if (fit := _fit(s)) is not None}
    if not fits:
        return {}
    cost = np.stack([f.cost[:, 0] for f in fits.values()])
    bad = cost[:, 0] > _BAD
    if not bad.any():
        return {}
    pooled = np.log(cost[bad] + 0.05).mean(axis=0)
    best = int(np.flatnonzero(pooled <= pooled.min() + np.log(_ALIKE))[0])
    named = bad & (cost[:, best] < np.minimum(_DECISIVE * cost[:, 0], _BAD))
    return {name: list(_READINGS)[best] for name, yes in zip(fits, named, strict=True) if yes}


def _sentence(reading: np.intp, axis: np.intp) -> str:
    parts = [list(_READINGS)[reading]] if reading else []
    if axis:
        parts.append(
            "gravity points down: the accelerometer has the opposite sign, or the world's z axis "
            "points down"
            if _AXIS_NAMES[axis] == "-z"
            else f"the world of the orientations has its {_AXIS_NAMES[axis]} axis up, not z"
        )
    return ", and ".join(parts)


def _unfit(fit: Fit) -> str:
    if fit.gravity[0, 0] > _GRAVITY:
        return (
            "orientations and accelerometer disagree in any order and direction: turned into the "
            f"world, gravity is {np.rad2deg(fit.tilt):.0f} deg from up in the mean and "
            f"{100 * fit.gravity[0, 0]:.0f} % off"
        )
    return "orientations and gyroscope disagree: they do not turn alike"


def _fit(series: Series) -> Fit | None:
    """None where there are no orientations with accelerations."""
    force = series.force
    good = np.isfinite(series.orientation).all(axis=1)
    whole = good[:-1] & good[1:] & np.isfinite(force).all(axis=1)
    if whole.sum() < _LEAST * series.window:
        return None
    size = float(np.median(np.linalg.norm(force[whole], axis=1)))
    gravity, correlation, slope, tilt = [], [], np.nan, 0.0
    for k, change in enumerate(_READINGS.values()):
        q = np.where(good[:, None], change(series.orientation), [1.0, 0.0, 0.0, 0.0])
        turn = Rotation.from_quat(q, scalar_first=True)
        step = (turn[:-1].inv() * turn[1:]).as_rotvec()
        middle = turn[:-1] * Rotation.from_rotvec(0.5 * step)
        means = _windowed(np.where(whole[:, None], middle.apply(np.nan_to_num(force)), np.nan),
                          series.window) / max(size, 1e-9)  # fmt: skip
        gravity.append(_off_axes(means))
        turning = np.where(whole[:, None], step / series.step, np.nan)
        found, factor = _rates_alike(turning, series.rate, series.step)
        correlation.append(found)
        if k == 0:
            slope, mean = factor, means.mean(axis=0)
            tilt = float(np.arccos(np.clip(mean[2] / max(np.linalg.norm(mean), 1e-9), -1, 1)))
    return Fit(np.stack(gravity), 1.0 - np.array(correlation), slope, tilt)


def _off_axes(means: np.ndarray) -> np.ndarray:
    """RMS distance of means (n, 3) from each axis, 0 to 1, scaled so that they fit it best.

    Their scale is that of a unit that is not known, and in fast motion sensors feel twice gravity
    or half of it in the median.
    """
    along = np.maximum((means @ _AXES.T).mean(axis=0), 0.0)
    power = max(float((means**2).sum(axis=1).mean()), 1e-12)
    return np.sqrt(np.maximum(1.0 - along**2 / power, 0.0))


def _windowed(values: np.ndarray, window: int) -> np.ndarray:
    """Means of successive windows that miss nothing; the mean of all where there is none."""
    count = len(values) // window
    means = values[: count * window].reshape(count, window, -1).mean(axis=1)
    means = means[np.isfinite(means).all(axis=1)]
    return means if len(means) else np.nanmean(values, axis=0, keepdims=True)


def _rates_alike(turning: np.ndarray, rate: np.ndarray, step: float) -> tuple[float, float]:
    """|Correlation| of the gyroscope with the rate of turning (1 where untold), and its factor."""
    width = max(int(round(_SMOOTH / step)), 1)
    both = np.hstack([turning, rate])
    if len(both) < width:
        return 1.0, np.nan
    both = np.lib.stride_tricks.sliding_window_view(both, width, axis=0).mean(axis=-1)
    both = both[np.isfinite(both).all(axis=1)]
    if len(both) < 20:
        return 1.0, np.nan
    # A constant offset of the gyroscope is no turning, and constant turning no contradiction.
    a, b = np.hsplit(both - both.mean(axis=0), 2)
    size = np.sqrt((a**2).sum(1).mean()), np.sqrt((b**2).sum(1).mean())
    if size[0] < _TURNING or size[1] < 1e-6:
        return 1.0, np.nan
    product = float((a * b).sum(1).mean())
    correlation = abs(product) / (size[0] * size[1])
    factor = product / size[1] ** 2 if correlation > 0.8 else np.nan
    # A gyroscope that hardly turns contradicts nothing: orientations have noise.
    return 1.0 if size[1] < _TURNING else correlation, factor
