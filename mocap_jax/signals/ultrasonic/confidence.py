"""w_s and w_t: how far a detected peak is trusted (Vlasic 2007, section 4.1)."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import Float


class ConfidenceFigures(Protocol):
    """Thresholds; amplitudes are relative to the direct sound on the axis at 1 m."""

    @property
    def noise(self) -> float: ...
    @property
    def gate(self) -> float: ...
    @property
    def strength_threshold(self) -> float: ...
    @property
    def strength_scale(self) -> float: ...
    @property
    def closing_speed(self) -> float: ...
    @property
    def jump_scale(self) -> float: ...
    @property
    def memory_s(self) -> float: ...


def signal_confidence(
    amplitude: Float[np.ndarray, "*b"], path: Float[np.ndarray, "*b"], figures: ConfidenceFigures
) -> Float[np.ndarray, "*b"]:
    """w_s: 1 above the threshold of normalised power, falling smoothly below, 0 under the gate.

    Vlasic 2007, section 4.1 lets w_s fall with the inverse square of the difference, which
    diverges at the threshold; the bounded form here is 1 / (1 + (difference / scale)^2).
    """
    power = (amplitude * path) ** 2
    short = np.maximum(figures.strength_threshold - power, 0.0)
    weight = 1.0 / (1.0 + (short / (figures.strength_scale * figures.strength_threshold)) ** 2)
    return np.where(amplitude > figures.gate * figures.noise, weight, 0.0)


def continuity_confidence(
    time: Float[np.ndarray, "n"],
    source: np.ndarray,
    path: Float[np.ndarray, "n r"],
    strength: Float[np.ndarray, "n r"],
    figures: ConfidenceFigures,
) -> Float[np.ndarray, "n r"]:
    """w_t: 1 where a distance continues the last one heard of its pair, falling to 0 with jumps.

    Distances may change at `closing_speed` since the last peak heard; what exceeds that lowers
    w_t linearly to 0 at `jump_scale`. Without a recent peak w_t is 1.
    """
    weight = np.ones_like(path)
    for s in np.unique(source):
        rows = np.flatnonzero(source == s)
        last = np.full(path.shape[1], np.nan)
        when = np.full(path.shape[1], -np.inf)
        for i in rows:
            elapsed = time[i] - when
            known = elapsed <= figures.memory_s
            allowed = figures.closing_speed * np.where(known, elapsed, 0.0)
            excess = np.maximum(np.abs(path[i] - last) - allowed, 0.0)
            weight[i] = np.where(known, np.maximum(1.0 - excess / figures.jump_scale, 0.0), 1.0)
            heard = strength[i] > 0
            last[heard], when[heard] = path[i, heard], time[i]
    return weight
