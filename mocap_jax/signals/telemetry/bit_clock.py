"""Bits from a voltage whose clock is known to some hundred parts per million only.

The square of the voltage has a line at the bit rate, since it dips between unlike bits only. Its
phase says where bits are centred, its frequency how fast the board's clock is (Oerder and Meyr
1988, IEEE Trans. Commun. 36, 605-612).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

_PARTS = 16
_FINE = 32
"""Frequencies tried for each that 16 parts resolve."""
_FASTEST_CLOCK = 4e-4
"""Largest error of a board's clock."""


@dataclass(frozen=True)
class SoftBits:
    """Voltages at the centres of k bits, and when those are."""

    values: Float[np.ndarray, "k"]
    time: Float[np.ndarray, "k"]
    """[s]"""


class BitClock:
    """Follows the clock of one wire from block to block.

    Args:
        bit_rate_hz: nominal.
        sample_rate_hz: of the voltages; more than four times the bit rate.
    """

    def __init__(self, bit_rate_hz: float, sample_rate_hz: float) -> None:
        self._bit_rate, self._rate = bit_rate_hz, sample_rate_hz
        self._next: int | None = None
        self._fit: tuple[float, float, float] | None = None
        self._turn = np.zeros(0, np.complex64)

    def bits(self, voltage: Float[np.ndarray, "n"], start: float, spare: int) -> SoftBits:
        """The bits of the next block.

        Args:
            voltage: the block's, with `spare` samples of its neighbours at either end.
            start: time of the first sample after the spare ones [s].
            spare: at least 4.
        """
        inner = voltage[spare : len(voltage) - spare]
        duration = len(inner) / self._rate
        centre, lag, drift = self._lag(inner, start)
        # Bit k is centred where bit_rate t - lag - drift (t - centre) = k.
        rate = self._bit_rate - drift
        offset = lag - drift * centre
        first = int(np.ceil(rate * start - offset)) if self._next is None else self._next
        last = int(np.ceil(rate * (start + duration) - offset))
        self._next, self._fit = last, (centre, lag, drift)
        time = (np.arange(first, last) + offset) / rate
        return SoftBits(_interpolate(voltage, (time - start) * self._rate + spare), time)

    def _lag(self, inner: np.ndarray, start: float) -> tuple[float, float, float]:
        """Time of the block's centre [s], lag there [bits] and drift of the lag [bits/s]."""
        part = len(inner) // _PARTS
        used = inner[: part * _PARTS]
        if len(self._turn) != len(used):
            turn = -2j * np.pi * self._bit_rate / self._rate
            self._turn = np.exp(turn * np.arange(len(used))).astype(np.complex64)
        line = (used * used * self._turn).reshape(_PARTS, part).sum(axis=1)
        span = len(used) / self._rate
        centre = start + 0.5 * span
        spectrum = np.fft.fft(line, _PARTS * _FINE)
        drifts = np.fft.fftfreq(_PARTS * _FINE, span / _PARTS)
        power = np.where(np.abs(drifts) <= _FASTEST_CLOCK * self._bit_rate, np.abs(spectrum), 0.0)
        best = int(np.argmax(power))
        # The line's own frequency lies `drift` beside the nominal one.
        drift = -drifts[best]
        middle = (np.arange(_PARTS) + 0.5) * span / _PARTS - 0.5 * span
        phase = np.angle((line * np.exp(2j * np.pi * drift * middle)).sum())
        lag = self._bit_rate * start - phase / (2 * np.pi)
        if self._fit is None:
            return centre, lag % 1.0, drift
        before, lag_before, drift_before = self._fit
        expected = lag_before + drift_before * (centre - before)
        return centre, expected + (lag - expected + 0.5) % 1.0 - 0.5, drift


def _interpolate(values: Float[np.ndarray, "n"], at: Float[np.ndarray, "k"]) -> np.ndarray:
    """Cubic Lagrange interpolation at fractional indices."""
    index = np.clip(np.floor(at).astype(np.int64), 1, len(values) - 3)
    x = at - index
    weights = (
        -x * (x - 1) * (x - 2) / 6, (x + 1) * (x - 1) * (x - 2) / 2,
        -(x + 1) * x * (x - 2) / 2, (x + 1) * x * (x - 1) / 6,
    )  # fmt: skip
    return sum(w * values[index + k - 1] for k, w in enumerate(weights))
