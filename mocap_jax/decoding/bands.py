"""The frequencies of a raw recording's bursts, and a detector for each."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError
from mocap_jax.recording import DriverBox
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, DetectorOptions
from mocap_jax.signals.ultrasonic.bands import APART_HZ, AUDIBLE_HZ
from mocap_jax.signals.ultrasonic.burst import CARRIER_HZ, Transducer
from mocap_jax.signals.wire import BLOCK_SAMPLES

_NOMINAL_SPEED = 343.0
"""For what is only roughly needed: where a slot ends."""


@dataclass(frozen=True)
class FrequencyBands:
    """Detectors that all wires share, one for each frequency."""

    frequency: dict[str, float]
    """Of the sources that are not of 40 kHz, by name [Hz]."""
    named: tuple[str, ...]
    """All names of the driver box's table, those of 40 kHz included."""
    carriers: tuple[float, ...]
    """Of the detectors [Hz]; the first is 40 kHz."""
    detectors: tuple[ArrivalDetector, ...]

    @property
    def index(self) -> dict[str, int]:
        """Detector of each source that is not of 40 kHz."""
        return {name: self.carriers.index(f) for name, f in self.frequency.items()}

    def of(self, sources: tuple[str, ...]) -> Float[np.ndarray, "s"]:
        """Frequencies of sources [Hz]."""
        return np.array([self.frequency.get(name, CARRIER_HZ) for name in sources])

    def strangers(self, sources: tuple[str, ...]) -> tuple[str, ...]:
        """Which names of the table no source bears, in a sentence: they may be misspelt, and then
        the sources that they mean are listened for at 40 kHz."""
        unknown = [name for name in self.named if name not in sources]
        if not unknown:
            return ()
        return (
            f"source_frequency_hz names {', '.join(unknown)}, which is no source of this "
            f"recording; sources: {', '.join(sources) or 'none'}",
        )

    def remarks(self, sources: tuple[str, ...]) -> tuple[str, ...]:
        """Which frequencies of sources are too near to each other to be told apart."""
        used = sorted(set(self.of(sources).tolist()))
        return tuple(
            f"sources of {low:g} and {high:g} Hz are less than {APART_HZ:g} Hz apart: the sound of "
            "one passes the filter of the other"
            for low, high in zip(used, used[1:], strict=False)
            if high - low < APART_HZ
        )


def frequency_bands(box: DriverBox, options: DetectorOptions) -> FrequencyBands:
    """Detectors for the sources of a driver box.

    Raises:
        InputError: no table of frequencies, or one that the amplifier does not pass.
    """
    low, high = AUDIBLE_HZ
    if not isinstance(box.source_frequency_hz, dict):
        raise InputError("source_frequency_hz must be a table of numbers by the names of sources")
    for name, f in box.source_frequency_hz.items():
        if isinstance(f, bool) or not isinstance(f, (int, float)) or not low <= f <= high:
            raise InputError(
                f"source_frequency_hz of '{name}': {f}; valid: numbers from {low:g} to {high:g}"
            )
    others = {n: float(f) for n, f in box.source_frequency_hz.items() if f != CARRIER_HZ}
    carriers = (CARRIER_HZ, *sorted(set(others.values())))
    detectors = tuple(
        ArrivalDetector(
            replace(options, transducer=_transducer(box, f)),
            speed=_NOMINAL_SPEED, reference=box.reference, length=BLOCK_SAMPLES,
        )
        for f in carriers
    )  # fmt: skip
    return FrequencyBands(others, tuple(box.source_frequency_hz), carriers, detectors)


def _transducer(box: DriverBox, frequency: float) -> Transducer:
    resonance = box.resonance_hz if frequency == CARRIER_HZ else frequency
    return Transducer(resonance, box.quality, frequency)
