"""What else is on a wire: ambient noise behind the amplifier, tones, the converter's noise."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy import signal

from mocap_jax.simulation.raw import amplifier
from mocap_jax.simulation.raw.transducer import SAMPLE_RATE_HZ

_TONE_HZ = 33_000.0


class WireNoise:
    """Noise of all wires; chunks continue each other.

    Args:
        ambient: amplitude of the noise in a band of 5 kHz about 40 kHz [steps].
        converter: standard deviation of white noise [steps].
        tone: amplitude of interference [steps].
        wires: their number.
        rng: random stream.
    """

    def __init__(
        self, ambient: float, converter: float, tone: float, wires: int, rng: np.random.Generator
    ) -> None:
        nyquist = SAMPLE_RATE_HZ / 2
        # The amplitude of a band is that of either quadrature: noise of the same variance.
        self._ambient = ambient * np.sqrt(nyquist / 5000.0)
        self._converter, self._tone, self._rng = converter, tone, rng
        self._sections = amplifier.sections()
        self._state = np.zeros((len(self._sections), wires, 2))
        self._phase = rng.uniform(0, 2 * np.pi, wires)

    def samples(self, first: int, count: int) -> Float[np.ndarray, "wires count"]:
        """Noise from sample `first` on; chunks must be asked for in order."""
        shape = (len(self._phase), count)
        out = self._converter * self._rng.standard_normal(shape, np.float32)
        if self._ambient:
            white = self._ambient * self._rng.standard_normal(shape, np.float32)
            filtered, self._state = signal.sosfilt(self._sections, white, axis=1, zi=self._state)
            out = out + filtered
        if self._tone:
            turn = 2 * np.pi * _TONE_HZ / SAMPLE_RATE_HZ * (first + np.arange(count))
            out = out + self._tone * np.sin(turn + self._phase[:, None])
        return out
