"""From 12-bit levels to the bits on the wire."""

from __future__ import annotations

import numpy as np
from jaxtyping import Int, UInt8

from mocap_jax.signals.telemetry.delta import Modulated, modulate
from mocap_jax.signals.telemetry.frame import (
    AXES,
    FRAMES,
    interleave,
    pack,
    scramble,
)


def encode(levels: Int[np.ndarray, "n 6"]) -> tuple[UInt8[np.ndarray, "bits"], Modulated]:
    """Bits of a board's frames, and what was modulated.

    Frame i of a superframe carries one half of the level of axis i // 2 as it stood after the
    even one of its two frames: the upper 6 bits first.

    Args:
        levels: 0 to 4095 of gyroscope and accelerometer, one row a frame. The last frames that do
            not fill a superframe are padded with the last row.
    """
    padded = np.concatenate([levels, np.repeat(levels[-1:], -len(levels) % FRAMES, axis=0)])
    modulated = modulate(padded)
    words = pack(modulated.codes, level_halves(modulated.levels))
    return scramble(interleave(words), 0), modulated


def level_halves(levels: Int[np.ndarray, "n 6"]) -> Int[np.ndarray, "n"]:
    """The 6 bits of a level that each frame carries (n a multiple of 12)."""
    snapshot = np.einsum("sii->si", levels[::2].reshape(-1, AXES, AXES))
    halves = np.stack([snapshot >> 6, snapshot & 63], axis=-1)
    return halves.reshape(-1)
