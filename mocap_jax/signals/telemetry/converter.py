"""The board's converter: 10-bit readings, several of which make one 12-bit level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mocap_jax.errors import InputError

READINGS = 16
"""Readings that are summed for one level; noise of half a reading's step makes the sum finer."""
_READING_LEVELS = 1024
_SHARE = READINGS // 4
"""The sum of 16 readings of 10 bits has 14 bits; the lowest two are dropped."""


@dataclass(frozen=True)
class ConverterScales:
    """What full scale means."""

    accelerometer: float = 8 * 9.81
    """Full scale, both ways [m/s^2]."""
    gyroscope: float = float(np.radians(600.0))
    """Full scale, both ways [rad/s]."""

    def __post_init__(self) -> None:
        for name in ("accelerometer", "gyroscope"):
            if not 0 < getattr(self, name) < float("inf"):
                raise InputError(f"{name} full scale {getattr(self, name)}: must be above 0")

    @property
    def per_level(self) -> Float[np.ndarray, "6"]:
        """Size of one of the 4096 levels: gyroscope [rad/s], then accelerometer [m/s^2]."""
        return np.repeat([self.gyroscope, self.accelerometer], 3) / 2048.0


def quantise(values: Float[np.ndarray, "*b 6"], scales: ConverterScales) -> Int[np.ndarray, "*b 6"]:
    """10-bit readings (0 to 1023) of rates [rad/s] and specific forces [m/s^2]."""
    steps = np.floor(values / (4.0 * scales.per_level)) + _READING_LEVELS // 2
    return np.clip(steps, 0, _READING_LEVELS - 1).astype(np.int64)


def accumulate(readings: Int[np.ndarray, "n 16 c"]) -> Int[np.ndarray, "n c"]:
    """12-bit levels of 16 readings each."""
    if readings.shape[1] != READINGS:
        raise InputError(f"{readings.shape[1]} readings a level: must be {READINGS}")
    return readings.sum(axis=1) // _SHARE


def physical(
    levels: Float[np.ndarray, "n 6"], scales: ConverterScales
) -> tuple[Float[np.ndarray, "n 6"], Bool[np.ndarray, "n 6"]]:
    """Rates [rad/s] and forces [m/s^2] of 12-bit levels, and which of them are saturated."""
    # Readings are rounded down (half a reading's step: 2 levels), the sum once more (half a level
    # less half a step of the sum, 3/8).
    values = (levels - 2048.0 + 2.0 + 0.375) * scales.per_level
    return values, (levels <= 1) | (levels >= 4 * _READING_LEVELS - 6)
