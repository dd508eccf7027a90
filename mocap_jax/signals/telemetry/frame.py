"""Layout of telemetry on the wire: frames, blocks of two, superframes of twelve.

A frame is a code word of 92 bits (`bch`): 36 bits of delta codes, 6 bits of a level, 8 check bits,
42 parity bits. The bits of two frames alternate in a block of 184, so that a burst of 12 wrong
bits is corrected. Twelve frames make a superframe, over which the scrambling pattern and the
levels sent go round once. `docs/telemetry.md` has the tables.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Int, UInt8

from mocap_jax.signals.telemetry import bch
from mocap_jax.signals.telemetry.delta import LARGEST

AXES = 6
FRAMES = 12
"""Frames of a superframe: two for the level of each axis."""
FRAME_BITS = bch.LENGTH
BLOCK_BITS = 2 * FRAME_BITS
SUPERFRAME_BITS = FRAMES * FRAME_BITS
FRAME_RATE_HZ = 140.0
BIT_RATE_HZ = FRAME_RATE_HZ * FRAME_BITS
"""12 880 bit/s."""

_CODE_BITS, _LEVEL_BITS, _CHECK_BITS = 6 * AXES, 6, 8
_CHECKED_BITS = _CODE_BITS + _LEVEL_BITS
_CHECK_POLYNOMIAL, _CHECK_START = np.uint8(0x2F), 0xFF
"""CRC-8 of x^8 + x^5 + x^3 + x^2 + x + 1 (AUTOSAR's)."""


def _pattern() -> np.ndarray:
    """The scrambling pattern: x^11 + x^9 + 1 from all ones, the first bits of its period 2047."""
    state, out = 0x7FF, []
    for _ in range(SUPERFRAME_BITS):
        bit = ((state >> 10) ^ (state >> 8)) & 1
        state = ((state << 1) | bit) & 0x7FF
        out.append(bit)
    return np.array(out, np.uint8)


PATTERN = _pattern()


def check_bits(bits: UInt8[np.ndarray, "n 42"]) -> UInt8[np.ndarray, "n 8"]:
    """The CRC-8 of codes and level bits."""
    state = np.full(len(bits), _CHECK_START, np.uint8)
    for column in bits.T:
        feedback = (state >> 7) ^ column
        state = (state << 1) ^ feedback * _CHECK_POLYNOMIAL
    return _to_bits(state, _CHECK_BITS)


def pack(
    codes: Int[np.ndarray, "n 6"], level_bits: Int[np.ndarray, "n"]
) -> UInt8[np.ndarray, "n 92"]:
    """Code words of delta codes (-31 to 31) and 6-bit halves of levels."""
    fields = [_to_bits(codes & 63, 6).reshape(len(codes), -1), _to_bits(level_bits, _LEVEL_BITS)]
    checked = np.concatenate(fields, axis=1)
    return bch.encode(np.concatenate([checked, check_bits(checked)], axis=1))


def unpack(
    words: UInt8[np.ndarray, "n 92"],
) -> tuple[
    Int[np.ndarray, "n 6"], Int[np.ndarray, "n"], Int[np.ndarray, "n"], Bool[np.ndarray, "n"]
]:
    """Codes, level bits and corrected bits of received words, and which words are accepted."""
    data, corrected, sound = bch.decode(words)
    checked = data[:, :_CHECKED_BITS]
    codes = _from_bits(checked[:, :_CODE_BITS].reshape(-1, AXES, 6))
    codes = np.where(codes > LARGEST, codes - 64, codes)
    valid = (check_bits(checked) == data[:, _CHECKED_BITS:]).all(axis=1)
    valid &= sound & (codes >= -LARGEST).all(axis=1)
    return codes, _from_bits(checked[:, _CODE_BITS:]), corrected, valid


def interleave(words: UInt8[np.ndarray, "n 92"]) -> UInt8[np.ndarray, "bits"]:
    """Bits on the wire, before scrambling, of an even number of words."""
    return words.reshape(-1, 2, FRAME_BITS).transpose(0, 2, 1).ravel()


def separate(bits: UInt8[np.ndarray, "bits"]) -> UInt8[np.ndarray, "n 92"]:
    """Words of whole blocks of descrambled bits."""
    return bits.reshape(-1, FRAME_BITS, 2).transpose(0, 2, 1).reshape(-1, FRAME_BITS)


def scramble(bits: UInt8[np.ndarray, "bits"], phase: int) -> UInt8[np.ndarray, "bits"]:
    """Add the pattern, of which `phase` bits have gone by before; its own inverse."""
    return bits ^ np.resize(np.roll(PATTERN, -phase), len(bits))


def _to_bits(values: Int[np.ndarray, "*b"], width: int) -> np.ndarray:
    return ((values[..., None] >> np.arange(width - 1, -1, -1)) & 1).astype(np.uint8)


def _from_bits(bits: np.ndarray) -> np.ndarray:
    return (bits.astype(np.int64) << np.arange(bits.shape[-1] - 1, -1, -1)).sum(axis=-1)
