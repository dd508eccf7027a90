"""`DriverBox`: figures of the raw signals that decoding needs (attachment `driver_box.toml`)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mocap_jax.errors import InputError

_POSITIVE = (
    "reference", "accelerometer_full_scale", "gyroscope_full_scale", "resonance_hz", "quality",
)  # fmt: skip
_TABLES = ("source_offset_m", "receiver_celsius")
CELSIUS = (-60.0, 60.0)
"""Temperatures of the air that are believed [degrees Celsius]; kelvin are not among them."""


@dataclass(frozen=True)
class DriverBox:
    """Levels, scales and calibration of the box that sampled the wires."""

    reference: float = 3000.0
    """Amplitude on the wires of the direct sound on a source's axis at 1 m, as the steady tone that
    the burst would become [steps of the converter]."""
    accelerometer_full_scale: float = 78.48
    """Of the boards' 12-bit levels, both ways [m/s^2] (8 g)."""
    gyroscope_full_scale: float = 10.471975511965978
    """The same [rad/s] (600 deg/s)."""
    resonance_hz: float = 40_000.0
    """Of the sources of 40 kHz; others resonate at their own frequency."""
    quality: float = 20.0
    """Q of the sources' resonance."""
    source_frequency_hz: dict[str, float] = field(default_factory=dict)
    """Of each source's bursts by site name; what is not named has 40 kHz."""
    source_offset_m: dict[str, float] = field(default_factory=dict)
    """Calibrated excess of each source's distances by site name [m]; what is not named has none."""
    receiver_celsius: dict[str, float] = field(default_factory=dict)
    """What the own thermometers of anchors that receive read, by site name [degrees Celsius]; what
    is not named has the recording's temperature."""

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            value = getattr(self, name)
            if not _finite(value) or value <= 0:
                raise InputError(f"{name}: {value}; valid: numbers above 0")
        for name in _TABLES:
            table = getattr(self, name)
            if not isinstance(table, dict):
                raise InputError(f"{name} must be a table of numbers by name")
            for key, value in table.items():
                if not _finite(value):
                    raise InputError(f"{name} of '{key}': {value}; valid: numbers")
        low, high = CELSIUS
        for key, value in self.receiver_celsius.items():
            if not low <= value <= high:
                raise InputError(
                    f"receiver_celsius of '{key}': {value}; valid: {low:g} to {high:g} degrees "
                    "Celsius"
                )


def _finite(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
