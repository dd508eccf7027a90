"""Delta modulation of 12-bit levels to 6-bit codes, with the round-off carried on.

A code stands for a step of the level; small steps are exact, large ones are spaced by a fifth. The
part of the running sum that was rounded away is added to the next level (Vlasic 2007, section
4.2: what one frame underestimates, the next one overestimates), so that sums and integrals of the
decoded levels stay within half a step of the true ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

LEVELS = 4096
"""Of the 12-bit quantities."""
LARGEST = 31
"""Largest code; a sample with it may have been faster than the codes can tell."""
_EXACT, _RATIO = 8, 1.21


def _steps() -> np.ndarray:
    k = np.arange(LARGEST + 1)
    grown = np.rint(_EXACT * _RATIO ** np.maximum(k - _EXACT, 0)).astype(np.int64)
    up = np.where(k <= _EXACT, k, grown)
    return np.concatenate([-up[:0:-1], up])


STEPS = _steps()
"""Step of the level for each code from -31 to 31."""
_MIDDLES = (STEPS[:-1] + STEPS[1:]) / 2


@dataclass(frozen=True)
class Modulated:
    """Codes of n frames and c channels, and what a receiver makes of them."""

    codes: Int[np.ndarray, "n c"]
    levels: Int[np.ndarray, "n c"]
    """Level after each frame."""
    overloaded: Bool[np.ndarray, "n c"]
    """The level moved faster than the largest step."""


def modulate(levels: Int[np.ndarray, "n c"]) -> Modulated:
    """Encode 12-bit levels; the first frame starts from its own level with a step of zero."""
    n, c = levels.shape
    codes, tracked = np.zeros((n, c), np.int64), np.zeros((n, c), np.int64)
    overloaded = np.zeros((n, c), bool)
    level, carry = levels[0].astype(np.int64), np.zeros(c)
    for i in range(n):
        wanted = levels[i] + carry - level
        code = np.searchsorted(_MIDDLES, wanted)
        after = level + STEPS[code]
        # A rounded step may lead outside of the 12 bits: take the next smaller one.
        code = code - (after >= LEVELS) + (after < 0)
        level = level + STEPS[code]
        missed = wanted - STEPS[code]
        room = 0.5 + 0.12 * np.abs(STEPS[code])
        overloaded[i] = (np.abs(code - LARGEST) == LARGEST) & (np.abs(missed) > room)
        # What an overload missed is lost; carried on, it would make later levels overshoot.
        carry = np.clip(missed, -room, room)
        codes[i], tracked[i] = code - LARGEST, level
    return Modulated(codes, tracked, overloaded)


def demodulate(codes: Int[np.ndarray, "n c"]) -> Int[np.ndarray, "n c"]:
    """Levels relative to the one before the first frame."""
    return np.cumsum(STEPS[codes + LARGEST], axis=0)
