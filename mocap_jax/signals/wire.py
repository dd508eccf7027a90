"""One wire: its samples, piece by piece, to arrivals of pulses and frames of telemetry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int, Int16

from mocap_jax.signals.telemetry.receive import TelemetryReceiver, TimedFrames
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, Arrivals
from mocap_jax.signals.ultrasonic.bands import (
    MARGIN,
    SAMPLE_RATE_HZ,
    TELEMETRY_RATE_HZ,
    TELEMETRY_STEP,
    spectrum_of,
)

BLOCK_SAMPLES = 76_800
"""Samples that are transformed at once."""
_SPARE = 8


@dataclass(frozen=True)
class Emissions:
    """Pulses of all frequencies, in order of time."""

    time: Float[np.ndarray, "p"]
    """[s]"""
    band: Int[np.ndarray, "p"]
    """Index of each pulse's detector."""

    def first(self, count: int) -> Emissions:
        """The first ones."""
        return Emissions(self.time[:count], self.band[:count])

    def until(self, time: float, *, inclusive: bool = True) -> Emissions:
        """Those up to a time [s]."""
        return self.first(int(np.searchsorted(self.time, time, "right" if inclusive else "left")))


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
        detectors: of arrivals, one for each frequency of bursts; they may be shared by wires.
        start: time of the first sample [s].
        silent: nothing but sound is on the wire, as on that of a microphone without a board.
    """

    def __init__(
        self, detectors: tuple[ArrivalDetector, ...], start: float, *, silent: bool = False
    ) -> None:
        self._detectors, self._silent = detectors, silent
        self._slot = max(detector.slot_samples for detector in detectors)
        self._inner = BLOCK_SAMPLES - 2 * MARGIN - self._slot  # new ones: 61 slots of 8 ms
        self._telemetry = TelemetryReceiver(TELEMETRY_RATE_HZ)
        self._waiting: list[np.ndarray] = [np.zeros(MARGIN, np.int16)]
        self._count = MARGIN
        self._block_start = start - MARGIN / SAMPLE_RATE_HZ
        self._parts: list[PulseArrivals] = []

    @property
    def end(self) -> float:
        """Time behind the last sample fed [s]."""
        return self._block_start + self._count / SAMPLE_RATE_HZ

    def feed(self, samples: Int16[np.ndarray, "n"], pulses: Emissions) -> None:
        """Take the next samples.

        Args:
            samples: those that follow the ones before.
            pulses: all emissions up to the end of these samples.
        """
        self._waiting.append(samples)
        self._count += len(samples)
        while self._count >= BLOCK_SAMPLES:
            self._block(pulses)

    def finish(self, pulses: Emissions) -> None:
        """Decode what is left; pulses whose slot is not complete are left out."""
        end = self.end
        left = self._count - MARGIN
        if left <= 0:
            return
        last = end - self._slot / SAMPLE_RATE_HZ
        spare = self._inner - (left - 1) % self._inner - 1
        silence = np.zeros(spare + self._slot + MARGIN, np.int16)
        recorded = self._count
        self._waiting.append(silence)
        self._count += len(silence)
        while self._count >= BLOCK_SAMPLES:
            self._block(pulses.until(last), recorded)
            recorded -= self._inner

    def _block(self, pulses: Emissions, recorded: int = BLOCK_SAMPLES) -> None:
        every = np.concatenate(self._waiting)
        block, start = every[:BLOCK_SAMPLES], self._block_start
        spectrum = spectrum_of(block)
        inner = start + MARGIN / SAMPLE_RATE_HZ
        here = np.arange(
            np.searchsorted(pulses.time, inner - 1e-9),
            np.searchsorted(pulses.time, inner + self._inner / SAMPLE_RATE_HZ - 1e-9),
        )
        for band, detector in enumerate(self._detectors):
            own = here[pulses.band[here] == band]
            if own.size:
                sound = detector.splitter.sound(spectrum)
                self._keep(own, detector.detect(*sound, pulses.time[own] - start, recorded))
        if not self._silent:
            self._receive(spectrum, inner)
        self._waiting, self._count = [every[self._inner :]], len(every) - self._inner
        self._block_start = start + self._inner / SAMPLE_RATE_HZ

    def _receive(self, spectrum: Complex[np.ndarray, "f"], inner: float) -> None:
        low, high = MARGIN // TELEMETRY_STEP - _SPARE, (MARGIN + self._inner) // TELEMETRY_STEP
        telemetry = self._detectors[0].splitter.telemetry(spectrum)
        self._telemetry.feed(telemetry[low : high + _SPARE], inner, _SPARE)

    def _keep(self, pulses: Int[np.ndarray, "n"], found: Arrivals) -> None:
        heard = np.isfinite(found.delay)
        pulse = pulses[heard]
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
