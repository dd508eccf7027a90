"""One wire split into its bands: the sound about 40 kHz or others, and telemetry below 13 kHz.

Blocks of whole slots are transformed once; each band is cut out of the spectrum and transformed
back at its own lower rate (overlap-save: the margins at either end of a block are given up).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from jaxtyping import Complex, Float

from mocap_jax.signals.ultrasonic.burst import NOMINAL, Transducer, envelope

SAMPLE_RATE_HZ = 150_000.0
MARGIN = 1200
"""Samples at the beginning of a block that filters spoil [8 ms]."""
SLOT_S, SLOT_SAMPLES, SLOT_M = 0.008, 1200, 2.75
"""Time between pulses of one frequency, its samples, and how far sound comes in it (Vlasic 2007,
section 3.2)."""
SOUND_STEP, TELEMETRY_STEP = 8, 2
"""Samples of the wire for each sample of the bands."""
SOUND_RATE_HZ = SAMPLE_RATE_HZ / SOUND_STEP
TELEMETRY_RATE_HZ = SAMPLE_RATE_HZ / TELEMETRY_STEP
LONGEST_M = 20.0
"""Longer distances are never looked for."""
_HALF_WIDTH_HZ, _SKIRT_HZ = 2500.0, 500.0
"""40 kHz +- 2.5 kHz (Vlasic 2007, section 4.1)."""
_MATCHED_WIDTH_HZ, _MATCHED_SKIRT_HZ = 3500.0, 2000.0
"""Tones beyond 5.5 kHz are kept out, for 5 % of the RMSE in white noise."""
AUDIBLE_HZ = (25_000.0, 55_000.0)
"""Frequencies of bursts that the amplifier passes (3 dB less at either end), with bands of their
own above the telemetry and below half the sampling rate."""
APART_HZ = 5000.0
"""Bursts of frequencies that are less apart pass each other's filters with a tenth of their
amplitude or more (docs/raw.md)."""
_TELEMETRY_PASS_HZ, _TELEMETRY_STOP_HZ = 8000.0, 13_000.0


def heard_in_slot(interval: float) -> float:
    """How far sound comes between two pulses of one frequency, `interval` seconds apart [m]."""
    return min(SLOT_M * interval / SLOT_S, LONGEST_M)


@dataclass(frozen=True)
class Bands:
    """One block, margins included."""

    sound: Complex[np.ndarray, "s"]
    """Complex amplitude within 2.5 kHz about the carrier f; the signal is Re(sound exp(2 pi i f
    t))."""
    matched: Complex[np.ndarray, "s"]
    """Output of the filter matched to the burst: in noise of spectrum N its peak is the burst's
    complex amplitude."""
    telemetry: Float[np.ndarray, "t"]


class BandSplitter:
    """Splits blocks of one length.

    Args:
        length: samples of a block, margins included; a multiple of 1200.
        transducer: the burst to match; its drive is the carrier.
    """

    def __init__(self, length: int, transducer: Transducer = NOMINAL) -> None:
        self.length, self._transducer = length, transducer
        offset = scipy.fft.fftfreq(length // SOUND_STEP, 1 / SOUND_RATE_HZ)
        self._offset = offset
        self._carrier = round(transducer.drive_hz * length / SAMPLE_RATE_HZ)
        self._narrow = _window(np.abs(offset), _HALF_WIDTH_HZ, _SKIRT_HZ)
        self._match = self._matching(offset)
        low = np.arange(length // TELEMETRY_STEP // 2 + 1) * SAMPLE_RATE_HZ / length
        self._low = _window(low, _TELEMETRY_PASS_HZ, _TELEMETRY_STOP_HZ - _TELEMETRY_PASS_HZ)

    def _matching(self, offset: np.ndarray) -> np.ndarray:
        """Conjugate spectrum of the burst in the band, scaled to unit gain for the burst."""
        time = np.arange(self.length // SOUND_STEP * 16) / SOUND_RATE_HZ / 16
        spectrum = scipy.fft.fft(envelope(time, self._transducer)) / 16
        half = len(offset) // 2
        spectrum = np.concatenate([spectrum[:half], spectrum[-half:]])
        spectrum = spectrum * _window(np.abs(offset), _MATCHED_WIDTH_HZ, _MATCHED_SKIRT_HZ)
        gain = (np.abs(spectrum) ** 2).sum() / len(offset)
        return (spectrum.conj() / gain).astype(np.complex64)

    def noise_power(self, *, matched: bool) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies about the carrier [Hz], and what white noise has there behind the filter."""
        return self._offset, np.abs(self._match if matched else self._narrow) ** 2

    def split(self, samples: np.ndarray) -> Bands:
        """Bands of a block of the wire's samples."""
        spectrum = spectrum_of(samples)
        return Bands(*self.sound(spectrum), self.telemetry(spectrum))

    def sound(
        self, spectrum: Complex[np.ndarray, "f"]
    ) -> tuple[Complex[np.ndarray, "s"], Complex[np.ndarray, "s"]]:
        """`Bands.sound` and `Bands.matched` of a block of this spectrum."""
        count = self.length // SOUND_STEP
        half, carrier = count // 2, self._carrier
        about = 2.0 / SOUND_STEP * np.concatenate(
            [spectrum[carrier : carrier + half], spectrum[carrier - half : carrier]]
        )  # fmt: skip
        return scipy.fft.ifft(about * self._narrow), scipy.fft.ifft(about * self._match)

    def telemetry(self, spectrum: Complex[np.ndarray, "f"]) -> Float[np.ndarray, "t"]:
        """`Bands.telemetry` of a block of this spectrum."""
        low = spectrum[: len(self._low)] * (self._low / TELEMETRY_STEP)
        return scipy.fft.irfft(low, self.length // TELEMETRY_STEP)


def spectrum_of(samples: np.ndarray) -> Complex[np.ndarray, "f"]:
    """Spectrum of a block of a wire's samples, which bands of all frequencies share."""
    return scipy.fft.rfft(samples.astype(np.float32))


def _window(frequency: np.ndarray, flat: float, skirt: float) -> np.ndarray:
    """1 up to `flat`, 0 from `flat + skirt` on, a cosine in between."""
    share = np.clip((frequency - flat) / skirt, 0.0, 1.0)
    return (0.5 + 0.5 * np.cos(np.pi * share)).astype(np.float32)
