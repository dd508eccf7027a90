"""Frame errors of telemetry against noise: voltages with white noise through the whole receiver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_jax.signals.telemetry.encode import encode
from mocap_jax.signals.telemetry.frame import BIT_RATE_HZ, FRAME_BITS, pack, unpack
from mocap_jax.signals.telemetry.levels import restore
from mocap_jax.signals.telemetry.line import voltage
from mocap_jax.signals.telemetry.receive import TelemetryReceiver

_RATE_HZ = 75_000.0
_SPARE = 8
_BLOCK = 37_500


@dataclass(frozen=True)
class Chain:
    """What the whole receiver made of noisy voltages."""

    bit_errors: float
    """Share of thresholded bits that are wrong."""
    lost: float
    """Share of frames sent that are missing."""
    wrong: float
    """Share of frames sent that came out with a wrong level."""


def through_the_chain(noise: float, seconds: float, seed: int) -> Chain:
    """Send a random walk with white noise of a standard deviation relative to the voltage."""
    rng = np.random.default_rng(seed)
    walk = 2048 + np.cumsum(rng.normal(0, 4, (int(140 * seconds), 6)), axis=0)
    bits, modulated = encode(np.clip(walk, 0, 4095).astype(np.int64))
    count = int(len(bits) / BIT_RATE_HZ * _RATE_HZ)
    start, ppm = 0.1 + rng.random(), 100.0 * rng.standard_normal()
    place = (np.arange(count + int(2.2 * _RATE_HZ)) / _RATE_HZ - start) * BIT_RATE_HZ
    place = place * (1.0 + 1e-6 * ppm)
    volts = voltage(bits, place) + noise * rng.standard_normal(len(place))
    receiver = TelemetryReceiver(_RATE_HZ)
    for first in range(_SPARE, len(volts) - _BLOCK - _SPARE, _BLOCK):
        piece = volts[first - _SPARE : first + _BLOCK + _SPARE]
        receiver.feed(piece, first / _RATE_HZ, _SPARE)
    timed = receiver.frames()
    levels = restore(timed.frames)
    sent = (timed.time[timed.frames.accepted] - start) * BIT_RATE_HZ * (1.0 + 1e-6 * ppm)
    frame = np.rint(sent / FRAME_BITS + 1.5).astype(np.int64)
    inside = (frame >= 0) & (frame < len(modulated.levels))
    right = modulated.levels[np.clip(frame, 0, len(modulated.levels) - 1)]
    known = np.isfinite(levels.values)
    wrong = ((levels.values != right) & known).any(axis=1) | ~inside
    total = len(modulated.levels)  # the last superframe is filled up
    at = np.rint(place).astype(np.int64)
    centre = (np.abs(place - at) < 0.02) & (at >= 0) & (at < len(bits))
    errors = (volts[centre] > 0) != bits[at[centre]]
    return Chain(float(errors.mean()), 1.0 - (inside.sum() / total), float(wrong.sum() / total))


@dataclass(frozen=True)
class Words:
    """What happened to code words on a channel that flips bits."""

    count: int
    refused: int
    wrong: int
    """Accepted although other than sent."""

    @property
    def wrong_bound(self) -> float:
        """Upper 95 % bound of the share accepted wrongly (Poisson)."""
        from scipy.stats import chi2

        return float(chi2.ppf(0.95, 2 * (self.wrong + 1)) / 2 / self.count)


def flipped_words(bit_errors: float, count: int, seed: int, batch: int = 50_000) -> Words:
    """Pack random frames, flip bits, unpack; without the help of the lock."""
    rng = np.random.default_rng(seed)
    refused = wrong = 0
    for first in range(0, count, batch):
        n = min(batch, count - first)
        codes, halves = rng.integers(-31, 32, (n, 6)), rng.integers(0, 64, n)
        words = pack(codes, halves)
        words ^= (rng.random(words.shape, np.float32) < bit_errors).astype(np.uint8)
        out_codes, out_halves, _, accepted = unpack(words)
        same = (out_codes == codes).all(axis=1) & (out_halves == halves)
        refused += int((~accepted).sum())
        wrong += int((accepted & ~same).sum())
    return Words(count, refused, wrong)
