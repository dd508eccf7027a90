"""Readings of two sensors on one even grid, cut into windows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_erosion

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.initialise.joint.options import JointOptions
from mocap_jax.recording import InertialStream, Recording

# Derivatives of rates: cubics through five samples, a central difference of fourth order.
_SAMPLES, _ORDER = 5, 3
# Standard deviation of that derivative, over noise and step.
_GAIN = np.sqrt(130.0) / 12.0
# A reading between two samples farther apart than so many steps is none.
_GAP = 1.6
# Windows in which more than this share of the samples misses are left out: rates are integrated.
_MISSING = 0.1
_SHORTEST = 2.0
# Slower relative turns tell no joint [rad/s].
_SLOWEST = 0.1


class Pair(NamedTuple):
    """Two sensors' readings: w windows of n samples; axis 1 is the sensor."""

    time: Float[np.ndarray, "w n"]
    step: float
    force: Float[np.ndarray, "w 2 n 3"]
    """Specific forces [m/s^2]."""
    rate: Float[np.ndarray, "w 2 n 3"]
    """Angular velocities [rad/s]."""
    turn: Float[np.ndarray, "w 2 n 3"]
    """Angular accelerations [rad/s^2]."""
    force_slope: Float[np.ndarray, "w 2 n 3"]
    """Derivative of `force` [m/s^3]."""
    turn_slope: Float[np.ndarray, "w 2 n 3"]
    """Derivative of `turn` [rad/s^3]."""
    known: Bool[np.ndarray, "w n"]
    turn_noise: float
    """Standard deviation of a component of `turn` by the declared noise [rad/s^2]."""


def pair_of(recording: Recording, first: str, second: str, options: JointOptions) -> Pair:
    """Readings of both sensors where both have them.

    Raises:
        InputError: an unknown sensor, the same one twice, one without accelerometer or gyroscope,
            or less than 2 s in common.
    """
    for name in (first, second):
        if name not in recording.inertial:
            raise unknown_name("sensor", name, recording.inertial)
    if first == second:
        raise InputError(f"a joint lies between two sensors, not between '{first}' and itself")
    streams = [recording.inertial[name] for name in (first, second)]
    for name, stream in zip((first, second), streams, strict=True):
        _check(name, stream)
    time, step = _grid(streams)
    if len(time) * step < _SHORTEST:
        raise InputError(
            f"sensors '{first}' and '{second}' have {len(time) * step:.3g} s in common; at least "
            f"{_SHORTEST:g} s are needed to find their joint"
        )
    read = [_at(stream, time, step) for stream in streams]
    force, rate = (np.stack([r[i] for r in read]) for i in (0, 1))
    turn, force_slope = _slope(rate, step), _slope(force, step)
    known = binary_erosion(read[0][2] & read[1][2], np.ones(_SAMPLES), border_value=1)
    size = min(len(time), max(int(round(options.window / step)), _SAMPLES))
    noise = recording.setup.noise.gyroscope * _GAIN / step
    cut = _Windows(size, len(time) // size)
    pair = Pair(
        cut.rows(time), step, cut.both(force), cut.both(rate), cut.both(turn),
        cut.both(force_slope), cut.both(_slope(turn, step)), cut.rows(known), float(noise),
    )  # fmt: skip
    good = pair.known.mean(1) > 1 - _MISSING
    if not good.any():
        raise InputError(
            f"sensors '{first}' and '{second}': gaps in every {options.window:g} s of readings; "
            "a shorter JointOptions.window may fit between them"
        )
    kept = (x[good] if isinstance(x, np.ndarray) else x for x in pair)
    return Pair(*kept)


class _Windows(NamedTuple):
    """How samples are cut; what is left at the end is too short for a window."""

    size: int
    number: int

    def rows(self, values: np.ndarray) -> np.ndarray:
        """Samples (t, ...) as (w, n, ...)."""
        kept = values[: self.size * self.number]
        return kept.reshape(self.number, self.size, *values.shape[1:])

    def both(self, values: np.ndarray) -> np.ndarray:
        """Samples of both sensors (2, t, 3) as (w, 2, n, 3)."""
        return np.stack([self.rows(v) for v in values], axis=1)


def check_motion(relative_rate: Float[np.ndarray, "*b 3"], first: str, second: str) -> float:
    """Root mean square relative rate [rad/s]; an error where there is hardly any."""
    size = float(np.sqrt((relative_rate**2).sum(-1).mean()))
    if size < _SLOWEST:
        raise InputError(
            f"sensors '{first}' and '{second}' hardly turn against each other ({size:.2g} rad/s "
            f"root mean square, at least {_SLOWEST:g} needed): no joint can be found"
        )
    return size


def _slope(values: Float[np.ndarray, "2 t 3"], step: float) -> Float[np.ndarray, "2 t 3"]:
    from scipy.signal import savgol_filter  # slow to import

    return savgol_filter(values, _SAMPLES, _ORDER, deriv=1, delta=step, axis=1)


def _check(name: str, stream: InertialStream) -> None:
    for kind in ("accelerometer", "gyroscope"):
        if np.isfinite(np.asarray(getattr(stream, kind))).all(axis=1).sum() < 2:
            raise InputError(f"sensor '{name}' has no {kind} readings: its joint is not to be had")


def _grid(streams: list[InertialStream]) -> tuple[np.ndarray, float]:
    """Even times in the interval that both streams cover, at the first one's rate."""
    times = [np.asarray(s.time, float) for s in streams]
    step = float(np.median(np.diff(times[0])))
    start, end = max(t[0] for t in times), min(t[-1] for t in times)
    return start + step * np.arange(max(int(np.floor((end - start) / step + 1e-6)) + 1, 0)), step


def _at(stream: InertialStream, time: np.ndarray, step: float) -> tuple[np.ndarray, ...]:
    """Force, rate and whether there are any, at times between samples along straight lines."""
    values = np.hstack([stream.accelerometer, stream.gyroscope]).astype(float)
    good = np.isfinite(values).all(axis=1)
    stamps, values = np.asarray(stream.time, float)[good], values[good]
    after = np.searchsorted(stamps, time - 1e-9 * step).clip(1, len(stamps) - 1)
    interval = max(step, float(np.median(np.diff(stamps))))
    known = stamps[after] - stamps[after - 1] < _GAP * interval
    known &= (time > stamps[0] - step / 2) & (time < stamps[-1] + step / 2)
    at = np.stack([np.interp(time, stamps, column) for column in values.T], axis=1)
    return at[:, :3], at[:, 3:], known
