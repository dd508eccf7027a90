"""Zeros and slopes of accelerometers from still positions, of gyroscopes from a turntable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mocap_jax.calibration.magnitude_fit import AxisFit, fit_axes, missing_directions
from mocap_jax.calibration.plateau import Plateau, plateau
from mocap_jax.calibration.steady import SteadyOptions, steady_intervals
from mocap_jax.errors import InputError
from mocap_jax.recording import Calibration, InertialStream, Recording, uncalibrated

_RPM = 2.0 * np.pi / 60.0
_LENGTH_SPAN = 0.25
"""Plateaus whose length differs by a larger share are of something else."""


@dataclass(frozen=True)
class AccelerometerOptions:
    """How still positions are recognised."""

    gravity: float = 9.81
    """Where the recording was made [m/s^2]."""
    still_force: float = 0.1
    """Largest standard deviation of specific force in a still block [m/s^2]."""
    still_rate: float = 0.02
    """The same of angular rate, where there is a gyroscope [rad/s]."""
    fastest: float = 0.5
    """Largest mean angular rate: a gyroscope's zero, not a turn [rad/s]."""
    steady: SteadyOptions = field(default_factory=SteadyOptions)


@dataclass(frozen=True)
class GyroscopeOptions:
    """The turntable."""

    rpm: float = 45.0
    """Its speed [1/min] (Vlasic 2007, section 4.3)."""
    accuracy: float = 0.001
    """Relative standard deviation of that speed (Vlasic 2007: 0.1 %)."""
    unsteady: float = 0.02
    """Largest standard deviation of angular rate in a block, as a share of the speed."""
    steady: SteadyOptions = field(default_factory=SteadyOptions)


@dataclass(frozen=True)
class InertialCalibration:
    """What was found of one kind of sensor."""

    kind: str
    """Either "accelerometer" or "gyroscope"."""
    length: float
    """Of the vector that was read [m/s^2 or rad/s]."""
    sensors: dict[str, AxisFit]
    skipped: dict[str, str]
    """Sensors that could not be calibrated, and why."""

    @property
    def calibration(self) -> Calibration:
        """For a set-up."""
        found = {name: fit.calibration for name, fit in self.sensors.items()}
        if self.kind == "accelerometer":
            return Calibration(accelerometer=found)
        return Calibration(gyroscope=found)


def calibrate_accelerometer(
    recordings: Sequence[Recording], options: AccelerometerOptions | None = None
) -> InertialCalibration:
    """Zero and slope of every accelerometer axis from still positions.

    Each axis is to point up and down once, held still for a second or longer, in one recording or
    several, all boards together or one by one; further positions improve the estimate. Positions
    need not be exact: they are found, and only their specific force's length is used.

    Args:
        recordings: calibrated ones are taken back to what was read.
        options: see there.

    Raises:
        InputError: no board has all six positions (those found are named).
    """
    opts = options or AccelerometerOptions()

    def still(stream: InertialStream, place: str) -> list[Plateau]:
        channels = [np.asarray(stream.accelerometer), np.asarray(stream.gyroscope)]
        kept = [np.isfinite(c).any() for c in channels]
        allowed = np.repeat([opts.still_force, opts.still_rate], 3)[np.repeat(kept, 3)]
        values = np.concatenate([c for c, there in zip(channels, kept, strict=True) if there], 1)
        found = steady_intervals(np.asarray(stream.time), values, allowed, opts.steady)
        if kept[1]:
            found = [s for s in found if _size(channels[1][s]) <= opts.fastest]
        return [plateau(stream, "accelerometer", s, place) for s in found]

    return _calibrated("accelerometer", recordings, still, opts.gravity, 0.0)


def calibrate_gyroscope(
    recordings: Sequence[Recording], options: GyroscopeOptions | None = None
) -> InertialCalibration:
    """Zero and slope of every gyroscope axis from a turntable.

    Each axis is to be turned both ways for a second or longer: the table turns both ways, or the
    board is turned over (Vlasic 2007, section 4.3). The board need not lie exactly level.

    Args:
        recordings: calibrated ones are taken back to what was read.
        options: see there.

    Raises:
        InputError: no board was turned both ways about all axes (what was found is named).
    """
    opts = options or GyroscopeOptions()
    speed = opts.rpm * _RPM

    def turning(stream: InertialStream, place: str) -> list[Plateau]:
        rate = np.asarray(stream.gyroscope)
        allowed = np.full(3, opts.unsteady * speed)
        found = steady_intervals(np.asarray(stream.time), rate, allowed, opts.steady)
        return [plateau(stream, "gyroscope", s, place) for s in found]

    return _calibrated("gyroscope", recordings, turning, speed, opts.accuracy)


def _calibrated(
    kind: str,
    recordings: Sequence[Recording],
    find: Callable[[InertialStream, str], list[Plateau]],
    length: float,
    length_sigma: float,
) -> InertialCalibration:
    """Plateaus of all recordings by sensor, fitted where all six directions are there."""
    plateaus: dict[str, list[Plateau]] = {}
    for i, recording in enumerate(recordings, 1):
        for name, stream in uncalibrated(recording).inertial.items():
            own = plateaus.setdefault(name, [])
            if np.isfinite(np.asarray(getattr(stream, kind))).any():
                found = find(stream, str(i) if len(recordings) > 1 else "")
                own += [p for p in found if _is_near(p, length)]
    sensors, skipped = {}, {}
    for name, own in plateaus.items():
        missing = missing_directions(own)
        if missing:
            skipped[name] = _what_is_missing(kind, own, missing)
        else:
            sensors[name] = fit_axes(own, length, length_sigma)
    if not sensors:
        if not skipped:
            raise InputError("no inertial sensors in these recordings (topics /inertial/<sensor>)")
        name, reason = next(iter(skipped.items()))
        more = f" (and {len(skipped) - 1} more)" if len(skipped) > 1 else ""
        raise InputError(f"sensor '{name}'{more}: {reason}")
    return InertialCalibration(kind, length, sensors, skipped)


def _is_near(p: Plateau, length: float) -> bool:
    return bool(abs(np.linalg.norm(p.mean) / length - 1.0) <= _LENGTH_SPAN)


def _what_is_missing(kind: str, found: list[Plateau], missing: tuple[str, ...]) -> str:
    what = "no still position" if kind == "accelerometer" else "no steady turn"
    along = "with the axis up along" if kind == "accelerometer" else "about"
    there = ", ".join(f"{p.direction or 'oblique'} at {p.start:.1f} s" for p in found[:12])
    return f"{what} {along} {', '.join(missing)}; found: {there or 'none'}"


def _size(values: np.ndarray) -> float:
    known = values[np.isfinite(values).all(axis=1)]
    return float(np.linalg.norm(known.mean(axis=0))) if len(known) else 0.0
