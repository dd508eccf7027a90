"""Sound at all microphones, chunk by chunk."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.simulation.raw.paths import Paths
from mocap_jax.simulation.raw.transducer import (
    PHASES,
    PULSE_SAMPLES,
    SAMPLE_RATE_HZ,
    pulse_table,
)

# Fainter sounds are far below the converter's step.
_INAUDIBLE = 1e-5


class SoundField:
    """Sums the pulses that arrive.

    Args:
        emission: times of the pulses, ascending [s].
        source: index of each pulse's source.
        paths: their ways.
        speed: of sound [m/s].
        late: extra delay of each source's pulses [s].
        resonators: resonance [Hz] and quality of each source.
    """

    def __init__(
        self,
        emission: Float[np.ndarray, "n"],
        source: np.ndarray,
        paths: Paths,
        speed: float,
        late: Float[np.ndarray, "s"],
        resonators: list[tuple[float, float]],
    ) -> None:
        self._emission, self._source, self._amplitude = emission, source, paths.amplitude
        self._begin = (emission + late[source])[:, None, None] + paths.length / speed
        self._longest = float((self._begin - emission[:, None, None]).max(initial=0.0))
        self._tables = np.stack([pulse_table(*r) for r in resonators]).astype(np.float32)

    def samples(self, first: int, count: int) -> Float[np.ndarray, "r count"]:
        """Sound from sample `first` on, relative to the direct sound on the axis at 1 m."""
        receivers = self._begin.shape[1]
        low = first / SAMPLE_RATE_HZ - self._longest - PULSE_SAMPLES / SAMPLE_RATE_HZ
        pulses = slice(
            np.searchsorted(self._emission, low),
            np.searchsorted(self._emission, (first + count) / SAMPLE_RATE_HZ),
        )
        amplitude, begin = self._amplitude[pulses], self._begin[pulses] * SAMPLE_RATE_HZ - first
        arriving = (begin > -PULSE_SAMPLES) & (begin < count) & (np.abs(amplitude) > _INAUDIBLE)
        pulse, receiver, _ = np.nonzero(arriving)
        begin, amplitude = begin[arriving], amplitude[arriving].astype(np.float32)
        steps = np.ceil(begin * PHASES).astype(np.int64)
        start = -(-steps // PHASES)
        rows = self._tables[self._source[pulses][pulse], start * PHASES - steps]
        # Pulses that begin before or end behind the chunk fall into its margins.
        width = count + 2 * PULSE_SAMPLES
        place = receiver[:, None] * width + start[:, None] + PULSE_SAMPLES
        flat = np.bincount(
            (place + np.arange(PULSE_SAMPLES)).ravel(),
            (amplitude[:, None] * rows).ravel(),
            receivers * width,
        )
        return flat.reshape(receivers, width)[:, PULSE_SAMPLES:-PULSE_SAMPLES]
