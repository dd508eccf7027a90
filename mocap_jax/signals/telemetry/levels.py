"""From accepted frames to 12-bit levels; what was lost stays lost.

Between two frames that were not accepted the codes give the levels up to a constant, and every
half superframe or so a pair of frames gives that constant for one axis. Each run of frames is
therefore levelled as a whole, forwards and backwards from any of its pairs. A run without a pair
for an axis has no levels of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mocap_jax.signals.telemetry.decode import Frames
from mocap_jax.signals.telemetry.delta import LARGEST, demodulate
from mocap_jax.signals.telemetry.frame import AXES, FRAME_BITS


@dataclass(frozen=True)
class Levels:
    """Levels of the n frames that were accepted."""

    bit: Int[np.ndarray, "n"]
    """See `Frames.bit`."""
    values: Float[np.ndarray, "n 6"]
    """NaN where the absolute level is unknown or contradicted."""
    overloaded: Bool[np.ndarray, "n 6"]
    """The largest step was sent: the true level may lie beyond."""
    gaps: Int[np.ndarray, "g 2"]
    """Bit of the last frame before each gap and of the first one behind it."""
    contradictions: int
    """Times that two levels of a run disagreed, as after a frame accepted wrongly."""


def restore(frames: Frames) -> Levels:
    """Levels of all frames that were accepted."""
    kept = np.flatnonzero(frames.accepted)
    bit, index = frames.bit[kept], frames.index[kept]
    codes = frames.codes[kept].astype(np.int64)
    halves = frames.level_bits[kept].astype(np.int64)
    values = np.full((len(kept), AXES), np.nan)
    breaks = np.flatnonzero(np.diff(bit) != FRAME_BITS) + 1
    contradictions = 0
    for run in np.split(np.arange(len(kept)), breaks):
        if run.size:
            values[run], wrong = _run(codes[run], index[run], halves[run])
            contradictions += wrong
    gaps = np.stack([bit[breaks - 1], bit[breaks]], axis=1)
    return Levels(bit, values, np.abs(codes) == LARGEST, gaps, contradictions)


def _run(
    codes: Int[np.ndarray, "n 6"], index: Int[np.ndarray, "n"], halves: Int[np.ndarray, "n"]
) -> tuple[np.ndarray, int]:
    """Levels of an unbroken run of frames."""
    relative = demodulate(codes).astype(float)
    out, contradictions = np.full(relative.shape, np.nan), 0
    even = np.flatnonzero(index[:-1] % 2 == 0)
    for axis in range(AXES):
        at = even[index[even] // 2 == axis]
        if not at.size:
            continue
        base = (halves[at] * 64 + halves[at + 1]) - relative[at, axis]
        changes = np.flatnonzero(np.diff(base))
        contradictions += len(changes)
        # A base holds from the first to the last pair that agree on it, and at the ends of the run
        # beyond; between pairs that disagree nobody knows where the fault lies.
        first = np.concatenate([[0], at[changes + 1]])
        last = np.concatenate([at[changes] + 1, [len(codes)]])
        for start, end, value in zip(first, last, base[np.append(changes, -1)], strict=True):
            out[start:end, axis] = relative[start:end, axis] + value
    return out, contradictions
