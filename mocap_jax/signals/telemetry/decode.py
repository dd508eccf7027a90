"""From received bits to frames: lock on the scrambling pattern, descramble, correct.

A decoder is fed bits in pieces of any size. Unlocked, it tries every phase of the pattern on the
next block and locks where three of the frames that follow are accepted as well; locked, it takes
block after block until two superframes in a row hold no sound frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from mocap_jax.signals.telemetry.frame import (
    AXES,
    BLOCK_BITS,
    FRAME_BITS,
    FRAMES,
    PATTERN,
    SUPERFRAME_BITS,
    scramble,
    separate,
    unpack,
)

_CONFIRMING_FRAMES = 3
_SILENT_FRAMES = 2 * FRAMES
_BLOCKS_AT_ONCE = 24
# A wire without telemetry is searched less and less often, up to every half second.
_LONGEST_PAUSE = 36
_HISTORY_BITS = 80 * BLOCK_BITS
"""Bits stepped over that are kept, to be decoded once the phase is known."""


@dataclass(frozen=True)
class Frames:
    """n frames that came from one lock or several."""

    bit: Int[np.ndarray, "n"]
    """Index, since the start of all bits, of the first bit of the frame's own place in its block:
    frames are spaced by 92 bits although their bits alternate."""
    index: Int[np.ndarray, "n"]
    """Place in the superframe, 0 to 11."""
    codes: Int[np.ndarray, "n 6"]
    level_bits: Int[np.ndarray, "n"]
    corrected: Int[np.ndarray, "n"]
    """Number of wrong bits."""
    accepted: Bool[np.ndarray, "n"]
    """Only these may be used; the others' codes are noise."""


def no_frames() -> Frames:
    """Frames of nothing."""
    none = np.zeros(0, np.int64)
    return Frames(none, none, np.zeros((0, AXES), np.int64), none, none, np.zeros(0, bool))


def join(parts: list[Frames]) -> Frames:
    """All frames of several pieces in order."""
    parts = parts or [no_frames()]
    return Frames(*(np.concatenate([getattr(p, f) for p in parts]) for f in Frames.__match_args__))


class FrameDecoder:
    """Finds frames in a stream of bits; memory is bounded by a second of bits."""

    def __init__(self) -> None:
        self._bits = np.zeros(0, np.uint8)
        self._start = 0
        self._phase: int | None = None
        self._silent = 0
        self._pause = 1
        self._sought = 0

    @property
    def locked(self) -> bool:
        """Whether the phase of the pattern is known."""
        return self._phase is not None

    def feed(self, bits: UInt8[np.ndarray, "k"]) -> Frames:
        """Frames that the bits so far complete."""
        self._bits = np.concatenate([self._bits, bits])
        parts: list[Frames] = []
        while True:
            if self._phase is None:
                if len(self._bits) - self._sought < 2 * SUPERFRAME_BITS:
                    break
                self._search()
                continue
            blocks = min(len(self._bits) // BLOCK_BITS, _BLOCKS_AT_ONCE)
            if not blocks:
                break
            parts.append(self._take(blocks, self._phase))
        return join(parts)

    def _take(self, blocks: int, phase: int) -> Frames:
        """Decode the next blocks."""
        count = blocks * BLOCK_BITS
        words = separate(scramble(self._bits[:count], phase))
        codes, level_bits, corrected, accepted = unpack(words)
        own = np.arange(len(words))
        frames = Frames(
            self._start + FRAME_BITS * own, (phase // FRAME_BITS + own) % FRAMES, codes, level_bits,
            corrected, accepted,
        )  # fmt: skip
        self._phase = (phase + count) % SUPERFRAME_BITS
        sound = np.flatnonzero(accepted)
        self._silent = len(words) - 1 - sound[-1] if sound.size else self._silent + len(words)
        if self._silent >= _SILENT_FRAMES:
            self._phase = None
        self._drop(count)
        return frames

    def _drop(self, count: int) -> None:
        self._bits, self._start = self._bits[count:], self._start + count

    def _search(self) -> None:
        """Find the phase within the next block, or step over it."""
        ahead = self._bits[self._sought :]
        window = np.lib.stride_tricks.sliding_window_view(ahead, BLOCK_BITS)[:BLOCK_BITS]
        patterns = PATTERN.reshape(-1, BLOCK_BITS)
        trials = window[:, None] ^ patterns[None]
        accepted = unpack(separate(trials.ravel()))[3].reshape(BLOCK_BITS, len(patterns), 2)
        for offset, block in np.argwhere(accepted.any(axis=2)):
            bits = ahead[offset : offset + SUPERFRAME_BITS]
            words = separate(scramble(bits, int(block) * BLOCK_BITS))
            if unpack(words)[3].sum() > _CONFIRMING_FRAMES:
                self._lock(self._sought + int(offset), int(block) * BLOCK_BITS)
                return
        self._sought += self._pause * BLOCK_BITS
        self._pause = min(2 * self._pause, _LONGEST_PAUSE)
        if self._sought > _HISTORY_BITS:
            spare = min(self._sought - _HISTORY_BITS, len(self._bits))
            self._drop(spare)
            self._sought -= spare

    def _lock(self, place: int, phase: int) -> None:
        """Start from a known phase, as many blocks earlier as are still held."""
        earlier = place // BLOCK_BITS
        self._phase = (phase - earlier * BLOCK_BITS) % SUPERFRAME_BITS
        # What was stepped over may be silence, which must not end the lock again.
        self._silent, self._pause, self._sought = -2 * earlier, 1, 0
        self._drop(place - earlier * BLOCK_BITS)


def hard_bits(soft: Float[np.ndarray, "k"]) -> UInt8[np.ndarray, "k"]:
    """Thresholded bits."""
    return (soft > 0).astype(np.uint8)
