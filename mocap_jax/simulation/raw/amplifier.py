"""The driver box's amplifier, which passes 25 to 55 kHz."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy import signal

from mocap_jax.simulation.raw.transducer import SAMPLE_RATE_HZ
from mocap_jax.simulation.suit import BURST_HZ

PASSED_HZ = (25_000.0, 55_000.0)
"""3 dB less at either end."""


def sections() -> Float[np.ndarray, "k 6"]:
    """Second-order sections of the filter."""
    return signal.butter(2, PASSED_HZ, "bandpass", fs=SAMPLE_RATE_HZ, output="sos")


def gain(frequency_hz: float) -> float:
    """How much louder than one of 40 kHz a tone becomes."""
    if frequency_hz == BURST_HZ:
        return 1.0
    _, response = signal.sosfreqz(sections(), [frequency_hz, BURST_HZ], fs=SAMPLE_RATE_HZ)
    own, usual = np.abs(response)
    return float(own / usual)
