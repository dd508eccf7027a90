"""True errors of sensors, told for readings that other figures correct.

The truth of a simulated recording tells what sensors err by after the calibration that its set-up
declares (whether that has been applied to the readings or not).
"""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.body.site_names import ANCHOR_PREFIX, SOURCE_PREFIX
from mocap_jax.recording.calibration import AxisCalibration, Calibration
from mocap_jax.recording.recording import Truth

_KINDS = ("accelerometer", "gyroscope")
_OFFSET = "source_offset/"
_NONE = AxisCalibration()

Told = dict[str, np.ndarray]


def with_true_errors(truth: Truth | None, old: Calibration, new: Calibration) -> Truth | None:
    """The truth of readings that were corrected by `old` figures, and now are by `new` ones."""
    if truth is None:
        return None
    told = {k: v for k, v in truth.parameters.items() if k.startswith(_OFFSET)}
    out: Told = {}
    for key, offset in told.items():
        name = key.removeprefix(_OFFSET)
        site = name if name.startswith(ANCHOR_PREFIX) else SOURCE_PREFIX + name
        out[key] = np.asarray(offset) + old.offset_of(site) - new.offset_of(site)
    for kind in _KINDS:
        before, after = getattr(old, kind), getattr(new, kind)
        for sensor in before | after:
            change = before.get(sensor, _NONE), after.get(sensor, _NONE)
            if change[0] != change[1]:
                out |= _inertial(truth, kind, sensor, *change)
    return dataclasses.replace(truth, parameters=truth.parameters | out)


def _inertial(
    truth: Truth, kind: str, sensor: str, old: AxisCalibration, new: AxisCalibration
) -> Told:
    """reading = zero_old + slope_old (scale * true + bias + drift) = zero + slope (...)."""
    ratio = np.array(old.slope) / np.array(new.slope)
    moved = (np.array(old.zero) - np.array(new.zero)) / np.array(new.slope)
    out: Told = {}
    for what, more in (("bias", moved), ("drift", 0.0), ("scale", 0.0)):
        key = f"{kind}_{what}/{sensor}"
        if key in truth.parameters:
            out[key] = ratio * np.asarray(truth.parameters[key]) + more
    return out
