"""Readings corrected by the calibration of their set-up, and the way back.

Set-up and readings go together: `Calibration.applied` says whether the readings are corrected, so
that nothing is corrected twice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from mocap_jax.recording.calibration import AxisCalibration, Calibration
from mocap_jax.recording.recording import Recording
from mocap_jax.recording.streams import InertialStream, RangeStream
from mocap_jax.recording.true_errors import with_true_errors


def calibrated(recording: Recording) -> Recording:
    """The recording with corrected readings: (reading - zero) / slope, and distances less offsets.

    Returned as it is where there is nothing to apply, or it has been applied.
    """
    calibration = recording.setup.calibration
    if calibration.applied or not calibration.corrects:
        return recording
    return _changed(recording, replace(calibration, applied=True), undo=False)


def uncalibrated(recording: Recording) -> Recording:
    """The recording as the sensors read it: `calibrated` undone."""
    calibration = recording.setup.calibration
    if not calibration.applied:
        return recording
    return _changed(recording, replace(calibration, applied=False), undo=True)


def with_calibration(
    recording: Recording, calibration: Calibration, noise: Mapping[str, float] | None = None
) -> Recording:
    """The recording corrected by other figures; what these do not name stays as declared.

    The truth of a simulated recording is told for the readings as they are corrected now.

    Args:
        recording: corrected or not.
        calibration: newer figures.
        noise: newer standard deviations, by their names in `NoiseFigures`.
    """
    raw = uncalibrated(recording)
    setup = replace(
        raw.setup,
        calibration=raw.setup.calibration.updated(calibration),
        noise=replace(raw.setup.noise, **(noise or {})),
    )
    truth = with_true_errors(raw.truth, raw.setup.calibration, setup.calibration)
    return calibrated(replace(raw, setup=setup, truth=truth))


def _changed(recording: Recording, calibration: Calibration, *, undo: bool) -> Recording:
    inertial = {
        name: _inertial(stream, name, calibration, undo=undo)
        for name, stream in recording.inertial.items()
    }
    ranges = recording.ranges
    if ranges is not None and calibration.source_offset:
        ranges = _ranges(ranges, calibration, undo=undo)
    setup = replace(recording.setup, calibration=calibration)
    return replace(recording, inertial=inertial, ranges=ranges, setup=setup)


def _inertial(
    stream: InertialStream, name: str, calibration: Calibration, *, undo: bool
) -> InertialStream:
    found: dict[str, jnp.ndarray] = {}
    for kind in ("accelerometer", "gyroscope"):
        axes: AxisCalibration | None = getattr(calibration, kind).get(name)
        if axes is not None:
            zero, slope = np.array(axes.zero), np.array(axes.slope)
            reading = jnp.asarray(getattr(stream, kind))
            found[kind] = zero + slope * reading if undo else (reading - zero) / slope
    return replace(stream, **found) if found else stream


def _ranges(ranges: RangeStream, calibration: Calibration, *, undo: bool) -> RangeStream:
    offset = np.array([calibration.offset_of(s) for s in ranges.source_names])
    each = jnp.asarray(offset)[jnp.asarray(ranges.source)] if offset.size else 0.0
    return replace(ranges, distance=jnp.asarray(ranges.distance) + (each if undo else -each))
