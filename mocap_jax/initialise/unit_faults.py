"""Units and signs of accelerometers and gyroscopes, whatever the pose and wherever a rest is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocap_jax.initialise.reading_series import STANDARD_GRAVITY, Series, rest_force
from mocap_jax.initialise.sensor_evidence import RATE_HZ, Evidence, averaged
from mocap_jax.initialise.sensor_units import gravity_faults, rate_factors
from mocap_jax.recording import InertialStream, Recording

# Rates are compared with gravity over this time after a rest [s].
_SPAN = 12.0
# Longer gaps in that time make rates useless for it [s].
_GAP = 0.1


class UnitFaults(NamedTuple):
    """By sensor."""

    faults: dict[str, list[str]]
    """Of accelerometers and gyroscopes."""
    measures: dict[str, dict[str, float]]
    """As those of `SensorCheck`."""
    unrested: list[str]
    """Sensors without a rest."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was judged by less than usual."""
        if not self.unrested:
            return ()
        names = ", ".join(self.unrested)
        return (f"No rest was found for {names}: gravity was judged in motion.",)


def unit_faults(
    recording: Recording, series: dict[str, Series], gravity: float = STANDARD_GRAVITY
) -> UnitFaults:
    """Compare every sensor's readings with gravity and with each other.

    Args:
        recording: measured streams.
        series: of its sensors.
        gravity: its size [m/s^2].
    """
    names = tuple(series)
    rests = [rest_force(series[n], gravity) for n in names]
    windows = [
        _after(recording.inertial[n], series[n], end)
        for n, (_, end) in zip(names, rests, strict=True)
    ]
    evidence = Evidence(
        names, (0,) * len(names), np.tile(np.eye(3), (len(names), 1, 1)), gravity,
        np.stack([force for force, _ in rests]), np.zeros((len(names), 0)),
        np.zeros((len(names), 0)), np.stack([rate for rate, _ in windows]),
        np.stack([force for _, force in windows]), False,
    )  # fmt: skip
    wrong_gravity = gravity_faults(evidence)
    _, wrong_rate, misfit = rate_factors(evidence)
    faults, measures = {}, {}
    for i, name in enumerate(names):
        faults[name] = [t for t in (wrong_gravity[i], wrong_rate[i]) if t is not None]
        norm = np.linalg.norm(series[name].force, axis=1)
        felt = float(np.linalg.norm(evidence.rest_force[i]))
        if not np.isfinite(felt):
            felt = float(np.nanmedian(norm)) if np.isfinite(norm).any() else float("nan")
        measures[name] = {
            "gravity": felt, "tilt_deg": float("nan"), "distance_error": float("nan"),
            "rate_misfit": float(misfit[i]),
        }  # fmt: skip
    measured = [np.isfinite(series[n].force).any() for n in names]
    unrested = [
        n for n, (_, end), m in zip(names, rests, measured, strict=True) if end is None and m
    ]
    return UnitFaults(faults, measures, unrested)


def _after(
    stream: InertialStream, series: Series, end: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Rates (offset at rest removed) and forces from the end of a rest on; NaN without one."""
    count = int(_SPAN * RATE_HZ)
    if end is None:
        return np.full((count, 3), np.nan), np.full((count, 3), np.nan)
    rest = series.rate[max(end - series.window, 0) : end]
    offset = np.zeros(3) if not np.isfinite(rest).all() else rest.mean(axis=0)
    time = float(stream.time[0]) + end * series.step + np.arange(count) / RATE_HZ
    rate = averaged(stream.time, stream.gyroscope, time) - offset
    force = averaged(stream.time, stream.accelerometer, time)
    if _longest_gap(stream, time[0], time[-1]) > _GAP:  # what turned in it is not known
        rate = np.full_like(rate, np.nan)
    return rate, force


def _longest_gap(stream: InertialStream, start: float, end: float) -> float:
    """Longest time without readings between two times [s]."""
    time = np.asarray(stream.time)
    both = np.hstack([stream.accelerometer, stream.gyroscope])
    good = time[np.isfinite(both).all(axis=1) & (time >= start) & (time <= end)]
    return float(np.diff(good).max(initial=0.0))
