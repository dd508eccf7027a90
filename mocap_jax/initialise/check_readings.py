"""`check_readings`: units, signs and conventions of a recording that has no body yet."""

from __future__ import annotations

import numpy as np

from mocap_jax.initialise.check_sensors import SensorCheck
from mocap_jax.initialise.neighbour_check import exchanged_neighbours
from mocap_jax.initialise.orientation_check import orientation_faults
from mocap_jax.initialise.reading_series import Series, rest_force, series_of
from mocap_jax.initialise.sensor_evidence import RATE_HZ, Evidence, averaged
from mocap_jax.initialise.sensor_units import gravity_faults, rate_factors
from mocap_jax.recording import InertialStream, Recording

_GRAVITY = 9.80665
# Rates are compared with gravity over this time after a rest [s].
_SPAN = 12.0
# Longer gaps in that time make rates useless for it [s].
_GAP = 0.1


def check_readings(recording: Recording, segments: dict[str, str] | None = None) -> SensorCheck:
    """Look for wrong units, signs, quaternion conventions and exchanged sensors, without a body.

    Compares each sensor's readings with each other: gravity at rest with 9.81 m/s^2, the gyroscope
    with the turning of gravity, orientations with both; and, where sensors measure orientation,
    sensors with their neighbours. What no reading shows is not found: accelerometer and
    orientation both upside down, left and right exchanged as a whole.

    Args:
        recording: measured streams.
        segments: Xsens segment of each sensor; default what the recording's provenance says
            (`segment/<sensor>`).
    """
    if not recording.inertial:
        return SensorCheck({}, remarks=("No inertial sensors to check.",))
    facts = recording.setup.provenance
    named = segments or {
        n: str(facts[f"segment/{n}"]) for n in recording.inertial if f"segment/{n}" in facts
    }
    with np.errstate(invalid="ignore", divide="ignore"):
        series = {name: series_of(stream) for name, stream in recording.inertial.items()}
        faults, measures, unrested = _unit_faults(recording, series)
        for name, texts in orientation_faults(series).items():
            known = any("gyroscope" in t for t in faults[name])
            faults[name] += [t for t in texts if not (known and t.startswith("gyroscope"))]
        sound = {n: s for n, s in series.items() if not _turns_wrongly(faults[n])}
        groups = exchanged_neighbours(sound, named)
    remarks = []
    if unrested:
        remarks.append(
            f"No rest was found for {', '.join(unrested)}: gravity was judged in motion."
        )
    return SensorCheck(
        {n: tuple(t) for n, t in faults.items()}, tuple(groups), measures, tuple(remarks)
    )


def _turns_wrongly(faults: list[str]) -> bool:
    return any("quaternions" in t or "orientations" in t for t in faults)


def _unit_faults(
    recording: Recording, series: dict[str, Series]
) -> tuple[dict[str, list[str]], dict[str, dict[str, float]], list[str]]:
    """Faults of accelerometers and gyroscopes, what was measured, and sensors without a rest."""
    names = tuple(series)
    rests = [rest_force(series[n]) for n in names]
    windows = [
        _after(recording.inertial[n], series[n], end)
        for n, (_, end) in zip(names, rests, strict=True)
    ]
    evidence = Evidence(
        names, (0,) * len(names), np.tile(np.eye(3), (len(names), 1, 1)), _GRAVITY,
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
        gravity = float(np.linalg.norm(evidence.rest_force[i]))
        if not np.isfinite(gravity):
            gravity = float(np.nanmedian(norm)) if np.isfinite(norm).any() else float("nan")
        measures[name] = {
            "gravity": gravity, "tilt_deg": float("nan"), "distance_error": float("nan"),
            "rate_misfit": float(misfit[i]),
        }  # fmt: skip
    measured = [np.isfinite(series[n].force).any() for n in names]
    unrested = [
        n for n, (_, end), m in zip(names, rests, measured, strict=True) if end is None and m
    ]
    return faults, measures, unrested


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
