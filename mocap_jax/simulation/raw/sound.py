"""Sound at all microphones, chunk by chunk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.simulation.raw import amplifier
from mocap_jax.simulation.raw.paths import Paths
from mocap_jax.simulation.raw.transducer import (
    PHASES,
    SAMPLE_RATE_HZ,
    pulse_samples,
    pulse_table,
)
from mocap_jax.simulation.suit import BURST_HZ

# Fainter sounds are far below the converter's step.
_INAUDIBLE = 1e-5


@dataclass(frozen=True)
class Resonator:
    """A source."""

    resonance_hz: float
    quality: float
    drive_hz: float = BURST_HZ
    """Of the ten cycles that drive it."""

    def table(self, samples: int) -> Float[np.ndarray, "phases samples"]:
        """See `pulse_table`; as the amplifier passes it."""
        pulse = pulse_table(self.resonance_hz, self.quality, self.drive_hz, samples)
        return amplifier.gain(self.drive_hz) * pulse


class SoundField:
    """Sums the pulses that arrive, of whatever frequency: a microphone hears all.

    Args:
        emission: times of the pulses, ascending [s].
        source: index of each pulse's source.
        paths: their ways.
        speed: of sound [m/s].
        late: extra delay of each source's pulses [s].
        resonators: the sources.
    """

    def __init__(
        self,
        emission: Float[np.ndarray, "n"],
        source: np.ndarray,
        paths: Paths,
        speed: float,
        late: Float[np.ndarray, "s"],
        resonators: list[Resonator],
    ) -> None:
        self._emission, self._source, self._amplitude = emission, source, paths.amplitude
        self._begin = (emission + late[source])[:, None, None] + paths.length / speed
        self._longest = float((self._begin - emission[:, None, None]).max(initial=0.0))
        self._length = max(pulse_samples(r.drive_hz) for r in resonators)
        self._tables = np.stack([r.table(self._length) for r in resonators]).astype(np.float32)

    def samples(self, first: int, count: int) -> Float[np.ndarray, "r count"]:
        """Sound from sample `first` on, relative to the direct sound on the axis at 1 m."""
        receivers, length = self._begin.shape[1], self._length
        low = first / SAMPLE_RATE_HZ - self._longest - length / SAMPLE_RATE_HZ
        pulses = slice(
            np.searchsorted(self._emission, low),
            np.searchsorted(self._emission, (first + count) / SAMPLE_RATE_HZ),
        )
        amplitude, begin = self._amplitude[pulses], self._begin[pulses] * SAMPLE_RATE_HZ - first
        arriving = (begin > -length) & (begin < count) & (np.abs(amplitude) > _INAUDIBLE)
        pulse, receiver, _ = np.nonzero(arriving)
        begin, amplitude = begin[arriving], amplitude[arriving].astype(np.float32)
        steps = np.ceil(begin * PHASES).astype(np.int64)
        start = -(-steps // PHASES)
        rows = self._tables[self._source[pulses][pulse], start * PHASES - steps]
        # Pulses that begin before or end behind the chunk fall into its margins.
        width = count + 2 * length
        place = receiver[:, None] * width + start[:, None] + length
        flat = np.bincount(
            (place + np.arange(length)).ravel(),
            (amplitude[:, None] * rows).ravel(),
            receivers * width,
        )
        return flat.reshape(receivers, width)[:, length:-length]
