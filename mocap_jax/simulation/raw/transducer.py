"""The pulse a source really emits: the differential equation of its resonator, solved exactly."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float
from scipy import signal

SAMPLE_RATE_HZ = 150_000.0
PHASES = 128
"""Starts of a pulse within a sample that are tabulated."""
_PULSE_SAMPLES = 320
_CARRIER_HZ, _CYCLES = 40_000.0, 10


def pulse_samples(drive_hz: float) -> int:
    """Length of a pulse; one of 40 kHz has rung down to 1e-5 after 2.1 ms."""
    return math.ceil(_PULSE_SAMPLES * _CARRIER_HZ / drive_hz)


def pulse_table(
    resonance_hz: float,
    quality: float,
    drive_hz: float = _CARRIER_HZ,
    samples: int = _PULSE_SAMPLES,
) -> Float[np.ndarray, "phases samples"]:
    """Samples of a burst of ten cycles that starts p/128 samples before the first one.

    x'' + (w / Q) x' + w^2 x = (w^2 / Q) drive, so that a steady tone at the resonance has unit
    amplitude.

    Args:
        resonance_hz: of the source.
        quality: Q of its resonance.
        drive_hz: of the ten cycles.
        samples: length of the table.
    """
    w = 2 * np.pi * resonance_hz
    system = ([w * w / quality], [1.0, w / quality, w * w])
    fine = 1.0 / (SAMPLE_RATE_HZ * PHASES)
    b, a, _ = signal.cont2discrete(system, fine, method="foh")
    time = np.arange(samples * PHASES) * fine
    drive = np.where(time < _CYCLES / drive_hz, np.sin(2 * np.pi * drive_hz * time), 0.0)
    wave = signal.lfilter(b.ravel(), a, drive)
    table = np.zeros((PHASES, samples))
    for p in range(PHASES):
        # Row p: the first sample lies p fine steps behind the beginning.
        table[p] = wave[p::PHASES]
    return table
