"""`check_readings`: units, signs and conventions of a recording that has no body yet."""

from __future__ import annotations

import numpy as np

from mocap_jax.initialise.neighbour_check import exchanged_neighbours
from mocap_jax.initialise.orientation_check import orientation_faults
from mocap_jax.initialise.reading_series import series_of
from mocap_jax.initialise.sensor_check import SensorCheck
from mocap_jax.initialise.unit_faults import unit_faults
from mocap_jax.recording import Recording


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
        found = unit_faults(recording, series)
        faults = found.faults
        for name, texts in orientation_faults(series).items():
            known = any("gyroscope" in t for t in faults[name])
            faults[name] += [t for t in texts if not (known and t.startswith("gyroscope"))]
        sound = {n: s for n, s in series.items() if not _turns_wrongly(faults[n])}
        groups = exchanged_neighbours(sound, named)
    return SensorCheck(
        {n: tuple(t) for n, t in faults.items()}, tuple(groups), found.measures, found.remarks
    )


def _turns_wrongly(faults: list[str]) -> bool:
    return any("quaternions" in t or "orientations" in t for t in faults)
