"""When a pulse arrives: two detectors over the same slots.

`inflection` is that of Vlasic 2007, section 4.1: the power envelope's steepest rise. `matched`
finds the peak of the matched filter's output, the most likely time of a known burst of unknown
amplitude and phase in white noise. Both look for the first sound that is loud enough for its
distance; what arrives early and faint is an echo of the pulse before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Complex, Float

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.signals.ultrasonic.bands import (
    LONGEST_M,
    MARGIN,
    SLOT_M,
    SLOT_SAMPLES,
    SOUND_RATE_HZ,
    SOUND_STEP,
    BandSplitter,
    heard_in_slot,
)
from mocap_jax.signals.ultrasonic.blur import blur
from mocap_jax.signals.ultrasonic.burst import CARRIER_HZ, Transducer, envelope

DETECTORS = ("matched", "inflection")
_TAPS = 12
"""Samples to either side that interpolation uses."""
_STEPS = 32
"""Interpolated points a sample."""
_RISE = 7
"""Samples before the peak in which the steepest rise of a burst of 40 kHz is sought."""
_SEEN_SAMPLES = 96_000
"""Length of the noise-free block that a detector is calibrated with."""


@dataclass(frozen=True)
class DetectorOptions:
    """Which detector, and what counts as a pulse."""

    detector: str = "matched"
    """`matched` or `inflection`."""
    gate: float = 4.0
    """Peaks below this many noise amplitudes are not heard (Vlasic 2007, 4.1: 'well above')."""
    share: float = 0.2
    """Peaks below this share of a slot's largest are not the first arrival."""
    faint: float = 0.04
    """Normalised power (relative to the direct sound on the axis at 1 m, times squared distance)
    below which a sound is passed over while a later one exceeds it: half of where w_s falls."""
    nearest_m: float = 0.05
    """Shorter distances are not looked for."""
    farthest_m: float | None = None
    """Nor longer ones; None: than sound comes in a slot (2.75 m in 8 ms; Vlasic 2007, section 3.2),
    since what comes later is not told from the next pulse."""
    transducer: Transducer = field(default_factory=Transducer)

    def __post_init__(self) -> None:
        if self.detector not in DETECTORS:
            raise unknown_name("detector", self.detector, DETECTORS)
        if self.farthest_m is not None and not self.nearest_m < self.farthest_m <= LONGEST_M:
            raise InputError(
                f"farthest_m {self.farthest_m:g}: valid are numbers above {self.nearest_m:g} up to "
                f"{LONGEST_M:g}"
            )

    def in_slots(self, interval: float) -> DetectorOptions:
        """These for pulses of one frequency every `interval` seconds."""
        if self.farthest_m is not None:
            return self
        return replace(self, farthest_m=max(heard_in_slot(interval), 2 * self.nearest_m))


@dataclass(frozen=True)
class Arrivals:
    """First arrivals of n pulses at one microphone; NaN where nothing was heard."""

    delay: Float[np.ndarray, "n"]
    """Since the emission [s]."""
    amplitude: Float[np.ndarray, "n"]
    """Of the steady tone that the burst would become, in the wire's units."""
    noise: float
    """Amplitude of noise on the same scale (parameter of its Rayleigh distribution)."""
    deviation: Float[np.ndarray, "n"]
    """Of the delays, from that noise alone [s]."""


class ArrivalDetector:
    """Finds first arrivals in the blocks of any number of wires.

    Args:
        options: which detector.
        speed: of sound [m/s].
        reference: amplitude of the direct sound on the axis at 1 m, in the wire's units.
        length: samples of a block, margins included.
    """

    def __init__(
        self, options: DetectorOptions, *, speed: float, reference: float, length: int
    ) -> None:
        self.splitter = BandSplitter(length, options.transducer)
        self._options, self._speed, self._reference = options, speed, reference
        self._farthest = SLOT_M if options.farthest_m is None else options.farthest_m
        self._stretch = CARRIER_HZ / options.transducer.drive_hz  # of ten cycles
        self._rise = round(_RISE * self._stretch)
        self._offset, self._gain, self._blur = 0.0, 1.0, 0.0
        self._offset, self._gain, self._blur = self._calibrated()

    @property
    def offset(self) -> float:
        """Time from the beginning of a nominal burst to what the detector marks [s]."""
        return self._offset

    @property
    def slot_samples(self) -> int:
        """Samples of a wire in which a pulse is looked for, in whole slots of 8 ms."""
        return math.ceil(self._farthest / SLOT_M - 1e-9) * SLOT_SAMPLES

    def _calibrated(self) -> tuple[float, float, float]:
        """Mark, gain and blur of a burst of unit amplitude, by detecting one without noise."""
        time = (np.arange(_SEEN_SAMPLES) - _SEEN_SAMPLES // 2) / (8 * SOUND_RATE_HZ)
        drive = self._options.transducer.drive_hz
        wave = envelope(time, self._options.transducer) * np.exp(2j * np.pi * drive * time)
        bands = BandSplitter(_SEEN_SAMPLES, self._options.transducer).split(wave.real * 1e3)
        sound = self._heard(bands.sound, bands.matched)
        at = np.array([_SEEN_SAMPLES / 16])
        peak = int(np.argmax(np.abs(sound)))
        mark, amplitude = self._mark(sound, np.array([peak]))
        blurred = self._blurred(sound / amplitude[0], mark[0])
        return float((mark - at)[0] / SOUND_RATE_HZ), float(amplitude[0]) / 1e3, blurred

    def _blurred(self, sound: np.ndarray, mark: float) -> float:
        """See `blur`, of a burst of unit amplitude."""
        first = int(mark) - 4
        fine = _between(sound, np.array([first]), 9)[0]
        matched = self._options.detector == "matched"
        offset, power = self.splitter.noise_power(matched=matched)
        step = 1.0 / (SOUND_RATE_HZ * _STEPS)
        return blur(fine, step, (mark - first) * _STEPS, offset, power, 1 if matched else 2)

    def _heard(self, narrow: np.ndarray, matched: np.ndarray) -> np.ndarray:
        return matched if self._options.detector == "matched" else narrow

    def detect(
        self,
        narrow: Complex[np.ndarray, "s"],
        matched: Complex[np.ndarray, "s"],
        emission: Float[np.ndarray, "n"],
        recorded: int | None = None,
    ) -> Arrivals:
        """First arrivals in one block of one wire.

        Args:
            narrow: see `Bands.sound`.
            matched: see `Bands.matched`.
            emission: times of the pulses since the block's first sample [s].
            recorded: samples of the block that are no filling at its end; None: all. The noise is
                measured in them.
        """
        sound = self._heard(narrow, matched)
        inner = MARGIN // SOUND_STEP
        last = len(sound) - inner if recorded is None else recorded // SOUND_STEP
        level = np.abs(sound[inner : min(last, len(sound) - inner)])
        noise = float(np.median(level)) / np.sqrt(np.log(4.0))
        start = emission * SOUND_RATE_HZ + self._offset * SOUND_RATE_HZ
        index, found = self._first(sound, start, noise)
        mark, amplitude = self._mark(sound, index)
        delay = mark / SOUND_RATE_HZ - self._offset - emission
        lost = ~found
        delay[lost], amplitude[lost] = np.nan, np.nan
        deviation = self._blur * noise / amplitude
        return Arrivals(delay, amplitude / self._gain, noise / self._gain, deviation)

    def _first(
        self, sound: np.ndarray, start: Float[np.ndarray, "n"], noise: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Index of the chosen peak of each slot, and whether there is one."""
        opts = self._options
        # The peak behind the steepest rise.
        late = 0.0 if opts.detector == "matched" else 3.0 * self._stretch
        first, last = (np.array([opts.nearest_m, self._farthest]) / self._speed) * SOUND_RATE_HZ
        begin = np.floor(start + first).astype(np.int64)
        window = begin[:, None] + np.arange(int(np.ceil(last - first + late)) + 2)
        level = np.abs(sound[np.clip(window, 0, len(sound) - 1)])
        middle = level[:, 1:-1]
        floor = np.maximum(opts.gate * noise, opts.share * middle.max(axis=1))
        peaks = (middle >= level[:, :-2]) & (middle > level[:, 2:]) & (middle > floor[:, None])
        way = np.maximum(window[:, 1:-1] - start[:, None] - late, 1.0) * self._speed / SOUND_RATE_HZ
        loud = peaks & ((middle * way / (self._gain * self._reference)) ** 2 > opts.faint)
        chosen = np.where(loud.any(axis=1), loud.argmax(axis=1), peaks.argmax(axis=1))
        return window[np.arange(len(window)), chosen + 1], peaks.any(axis=1)

    def _mark(self, sound: np.ndarray, peak: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fractional index of the mark of each peak, and the peak's amplitude."""
        peak = np.clip(peak, _TAPS + self._rise, len(sound) - _TAPS - 3)
        if self._options.detector == "matched":
            level = np.abs(_between(sound, peak - 1, 2))
            at, top = _vertex(level)
            return peak - 1 + at / _STEPS, top
        power = np.abs(_between(sound, peak - self._rise, self._rise + 1)) ** 2
        steepest, _ = _vertex(np.diff(power, axis=1))
        return peak - self._rise + (steepest + 0.5) / _STEPS, np.sqrt(power.max(axis=1))


def _kernel() -> np.ndarray:
    """Weights of samples -12 ... 13 for points 0, 1/32, ..., 31/32 of a sample further."""
    point = np.arange(_STEPS)[:, None] / _STEPS
    distance = point - np.arange(-_TAPS, _TAPS + 2)
    edge = np.clip(distance / (_TAPS + 1.5), -1.0, 1.0)
    return np.sinc(distance) * np.i0(8.0 * np.sqrt(1.0 - edge**2)) / np.i0(8.0)


_KERNEL = _kernel()


def _between(
    sound: Complex[np.ndarray, "s"], start: np.ndarray, count: int
) -> Complex[np.ndarray, "n f"]:
    """Values at 32 points a sample over `count` samples from each start on."""
    taps = np.arange(-_TAPS, _TAPS + 2)
    at = start[:, None, None] + np.arange(count)[:, None] + taps
    return (sound[at] @ _KERNEL.T).reshape(len(start), count * _STEPS)


def _vertex(values: Float[np.ndarray, "n f"]) -> tuple[np.ndarray, np.ndarray]:
    """Fractional index and value of each row's largest, by a parabola through its neighbours."""
    best = np.clip(values.argmax(axis=1), 1, values.shape[1] - 2)
    rows = np.arange(len(values))
    before, here, after = (values[rows, best + k] for k in (-1, 0, 1))
    bend = before - 2.0 * here + after
    shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, 1.0), 0.0)
    shift = np.clip(shift, -1.0, 1.0)
    return best + shift, here - 0.25 * (before - after) * shift
