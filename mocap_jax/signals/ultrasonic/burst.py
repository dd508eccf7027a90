"""The pulse as the detector expects it: a burst of ten cycles through a resonant transducer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

CARRIER_HZ = 40_000.0
CYCLES = 10


@dataclass(frozen=True)
class Transducer:
    """A piezoelectric source, a resonator of second order."""

    resonance_hz: float = CARRIER_HZ
    quality: float = 20.0
    """Q: 3 dB bandwidth of 2 kHz, as data sheets of open 16 mm transducers (400ST160: 2.0 kHz at
    6 dB, 400ST100: 2.5 kHz) give it."""
    drive_hz: float = CARRIER_HZ
    """Of the ten cycles that drive it."""


NOMINAL = Transducer()


def envelope(
    time: Float[np.ndarray, "n"], transducer: Transducer = NOMINAL
) -> Complex[np.ndarray, "n"]:
    """Complex amplitude about the drive's frequency after a burst that starts at time 0 [s].

    The slow part of the resonator's response: it rises towards 1 while driven and rings down
    afterwards, both with the time constant Q / (pi f).
    """
    decay = np.pi * transducer.resonance_hz / transducer.quality
    detuning = 2 * np.pi * (transducer.resonance_hz - transducer.drive_hz)
    pole = -decay + 1j * detuning
    driven = CYCLES / transducer.drive_hz
    during = 1.0 - np.exp(pole * np.clip(time, 0.0, driven))
    after = np.exp(pole * np.maximum(time - driven, 0.0))
    return np.where(time < 0, 0.0, during * after) * decay / -pole
