"""Bits as a voltage: pulses of a raised cosine over two bit periods, which do not interfere."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8


def voltage(bits: UInt8[np.ndarray, "k"], place: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Voltage between -1 and 1.

    Args:
        bits: what is sent, for ever preceded and followed by silence (0 V).
        place: times in bit periods; bit i is centred at i.
    """
    signs = np.concatenate([[0.0], 2.0 * bits - 1.0, [0.0]])
    before = np.floor(place).astype(np.int64)
    share = 0.5 - 0.5 * np.cos(np.pi * (place - before))
    last = len(signs) - 1
    first = signs[np.clip(before + 1, 0, last)]
    return first + share * (signs[np.clip(before + 2, 0, last)] - first)
