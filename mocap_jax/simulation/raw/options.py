"""Options of the raw simulation that no profile has."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mocap_jax.errors import InputError

_FROM_ZERO = {
    "humidity": 100.0, "floor_reflection": 1.0, "wall_reflection": 1.0, "converter_noise": 32768.0,
    "microphone_beam": 10.0, "interference": 32768.0, "detune_hz": 5000.0, "clock_ppm": 300.0,
}  # fmt: skip
"""Largest value of each option that may be 0."""
_CHUNK = (1e-3, 60.0)
"""Shorter chunks are more headers than samples, longer ones fill the memory [s]."""


@dataclass(frozen=True)
class RawOptions:
    """Levels on the wires, and the room."""

    reference: float = 3000.0
    """Amplitude on the wire of the steady tone that the direct sound on the axis at 1 m would
    become [steps of the converter]; nearer than about 10 cm the converter saturates."""
    telemetry: float = 800.0
    """Amplitude of the telemetry [steps], well below that of the sound (Vlasic 2007, 3.3)."""
    converter_noise: float = 5.0
    """White noise of the driver box's converter [steps]."""
    humidity: float = 50.0
    """Relative [%]."""
    floor_reflection: float = 0.7
    """Amplitude reflected by the floor (parquet: 0.9; thin carpet: 0.5)."""
    wall_reflection: float = 0.6
    """Amplitude reflected by walls and ceiling."""
    wall_distance_m: float = 1.5
    """From the walls to the nearest place that a source reaches."""
    floor_m: float | None = None
    """Height of the floor; None: below the lowest worn device, as below that of a foot."""
    ceiling_m: float = 2.6
    """Height of the ceiling over the floor."""
    microphone_beam: float = 0.15
    """Directivity ((1 + cos angle) / 2)^beam of a small microphone flush with its board: -1 dB at
    90 degrees, -6 dB at 150 (Vlasic 2007, section 3.1: 'a wide-angle response')."""
    interference: float = 0.0
    """Amplitude of a steady tone at 33 kHz (a switching supply) [steps]."""
    detune_hz: float = 0.0
    """Standard deviation of the sources' resonance about 40 kHz."""
    clock_ppm: float = 50.0
    """Standard deviation of the boards' clocks, parts per million."""
    chunk_s: float = 0.5
    """Length of a chunk of samples."""

    def __post_init__(self) -> None:
        for name in ("reference", "telemetry", "wall_distance_m", "ceiling_m"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name} {getattr(self, name):g}: valid are numbers above 0")
        if self.floor_m is not None and not math.isfinite(self.floor_m):
            raise InputError(f"floor_m {self.floor_m:g}: valid are heights [m]")
        low, high = _CHUNK
        if not low <= self.chunk_s <= high:
            raise InputError(f"chunk_s {self.chunk_s:g}: valid are {low:g} to {high:g}")
        for name, most in _FROM_ZERO.items():
            if not 0 <= getattr(self, name) <= most:
                raise InputError(f"{name} {getattr(self, name):g}: valid are 0 to {most:g}")
