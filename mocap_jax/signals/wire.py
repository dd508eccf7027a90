"""One wire: its samples, piece by piece, to arrivals of pulses and frames of telemetry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, Int16

from mocap_jax.signals.telemetry.receive import TelemetryReceiver, TimedFrames
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, Arrivals
from mocap_jax.signals.ultrasonic.bands import (
    MARGIN,
    SAMPLE_RATE_HZ,
    TAIL,
    TELEMETRY_RATE_HZ,
    TELEMETRY_STEP,
)

BLOCK_SAMPLES = 76_800
"""Samples that are transformed at once."""
INNER_SAMPLES = BLOCK_SAMPLES - MARGIN - TAIL
"""Of which are new: 61 slots of 8 ms."""
_SPARE = 8


@dataclass(frozen=True)
class PulseArrivals:
    """First arrivals of n pulses at one microphone."""

    pulse: Int[np.ndarray, "n"]
    """Index into all pulses."""
    delay: Float[np.ndarray, "n"]
    """Since the emission [s]."""
    amplitude: Float[np.ndarray, "n"]
    deviation: Float[np.ndarray, "n"]
    """Of the delays, from noise alone [s]."""


class WireDecoder:
    """Decodes one wire in bounded memory.

    Args:
        detector: of arrivals; it may be shared by wires.
        start: time of the first sample [s].
    """

    def __init__(self, detector: ArrivalDetector, start: float) -> None:
        self._detector = detector
        self._telemetry = TelemetryReceiver(TELEMETRY_RATE_HZ)
        self._waiting: list[np.ndarray] = [np.zeros(MARGIN, np.int16)]
        self._count = MARGIN
        self._block_start = start - MARGIN / SAMPLE_RATE_HZ
        self._parts: list[PulseArrivals] = []

    @property
    def end(self) -> float:
        """Time behind the last sample fed [s]."""
        return self._block_start + self._count / SAMPLE_RATE_HZ

    def feed(self, samples: Int16[np.ndarray, "n"], pulses: Float[np.ndarray, "p"]) -> None:
        """Take the next samples.

        Args:
            samples: those that follow the ones before.
            pulses: times of all emissions up to the end of these samples, ascending [s].
        """
        self._waiting.append(samples)
        self._count += len(samples)
        while self._count >= BLOCK_SAMPLES:
            self._block(pulses)

    def finish(self, pulses: Float[np.ndarray, "p"]) -> None:
        """Decode what is left; pulses whose slot is not complete are left out."""
        end = self.end
        left = self._count - MARGIN
        if left <= 0:
            return
        last = end - MARGIN / SAMPLE_RATE_HZ
        silence = np.zeros(INNER_SAMPLES - (left - 1) % INNER_SAMPLES - 1 + TAIL, np.int16)
        self._waiting.append(silence)
        self._count += len(silence)
        while self._count >= BLOCK_SAMPLES:
            self._block(pulses[pulses <= last])

    def _block(self, pulses: Float[np.ndarray, "p"]) -> None:
        every = np.concatenate(self._waiting)
        block, start = every[:BLOCK_SAMPLES], self._block_start
        bands = self._detector.splitter.split(block)
        inner = start + MARGIN / SAMPLE_RATE_HZ
        here = slice(
            np.searchsorted(pulses, inner - 1e-9),
            np.searchsorted(pulses, inner + INNER_SAMPLES / SAMPLE_RATE_HZ - 1e-9),
        )
        found = self._detector.detect(bands.sound, bands.matched, pulses[here] - start)
        self._keep(here, found)
        low, high = MARGIN // TELEMETRY_STEP - _SPARE, (BLOCK_SAMPLES - TAIL) // TELEMETRY_STEP
        self._telemetry.feed(bands.telemetry[low : high + _SPARE], inner, _SPARE)
        self._waiting, self._count = [every[INNER_SAMPLES:]], len(every) - INNER_SAMPLES
        self._block_start = start + INNER_SAMPLES / SAMPLE_RATE_HZ

    def _keep(self, here: slice, found: Arrivals) -> None:
        heard = np.isfinite(found.delay)
        pulse = np.arange(here.start, here.stop)[heard]
        columns = (found.delay, found.amplitude, found.deviation)
        # Half the bytes, and delays still exact to a nanosecond: hours of them are kept.
        small = (column[heard].astype(np.float32) for column in columns)
        self._parts.append(PulseArrivals(pulse.astype(np.int32), *small))

    def arrivals(self) -> PulseArrivals:
        """All pulses heard so far."""
        columns = [(p.pulse, p.delay, p.amplitude, p.deviation) for p in self._parts]
        if not columns:
            none = np.zeros(0)
            return PulseArrivals(none.astype(np.int64), none, none, none)
        return PulseArrivals(*(np.concatenate(c) for c in zip(*columns, strict=True)))

    def frames(self) -> TimedFrames:
        """All frames so far."""
        return self._telemetry.frames()
