"""Errors of detected arrivals in white noise, beside the Cramer-Rao bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, Arrivals, DetectorOptions
from mocap_jax.signals.wire import BLOCK_SAMPLES
from mocap_jax.simulation.raw.paths import Paths
from mocap_jax.simulation.raw.sound import Resonator, SoundField
from mocap_jax.simulation.raw.transducer import PHASES, SAMPLE_RATE_HZ, pulse_table

SPEED = 343.0
AMPLITUDE = 1000.0
SLOTS = 1200 / SAMPLE_RATE_HZ + 0.008 * np.arange(60)
"""Emissions of one block [s]."""
RESONATOR = (40_000.0, 20.0)
_GROSS_M = 0.05


@dataclass(frozen=True)
class Level:
    """One detector at one signal-to-noise ratio."""

    rmse: float
    """Of all pulses that are not lost [m]."""
    bound: float
    """Of Cramer and Rao [m]."""
    lost: float
    """Share of pulses not heard, or wrong by more than 5 cm: peaks of noise."""


def noise_of(ratio_db: float) -> float:
    """Deviation sigma of white noise with E / N0 = sum(s^2) / (2 sigma^2) [dB] of a pulse s."""
    energy = AMPLITUDE**2 * float((pulse_table(*RESONATOR)[0] ** 2).sum())
    return float(np.sqrt(energy / 2.0 / 10.0 ** (ratio_db / 10.0)))


def bound(ratio_db: float) -> float:
    """Cramer-Rao bound of a distance [m]; arrival time, amplitude and phase are unknown.

    The pulse is the simulator's; its phase turns by the Hilbert transform.
    """
    fine = pulse_table(*RESONATOR).T.ravel()  # 128 values a sample
    wave = np.concatenate([np.zeros(len(fine)), fine, np.zeros(len(fine))])
    slope = np.gradient(wave, 1.0 / (SAMPLE_RATE_HZ * PHASES))
    quarter = np.imag(signal.hilbert(wave))
    J = AMPLITUDE * np.stack([slope, wave, quarter])[:, ::PHASES]
    covariance = noise_of(ratio_db) ** 2 * np.linalg.inv(J @ J.T)
    return float(SPEED * np.sqrt(covariance[0, 0]))


def level(detector: str, ratio_db: float, blocks: int, seed: int) -> Level:
    """Detect 60 pulses a block at random distances of 0.7 m to 2 m."""
    rng, errors = np.random.default_rng(seed), []
    options = DetectorOptions(detector=detector)
    detect = ArrivalDetector(options, speed=SPEED, reference=AMPLITUDE, length=BLOCK_SAMPLES)
    for _ in range(blocks):
        distance = rng.uniform(0.7, 2.0, len(SLOTS))
        samples = noise_of(ratio_db) * rng.standard_normal(BLOCK_SAMPLES)
        found = arrivals(detect, samples + wire(distance, np.full(len(SLOTS), AMPLITUDE)))
        errors.append(SPEED * found.delay - distance)
    error = np.concatenate(errors)
    good = np.abs(error) < _GROSS_M
    return Level(
        float(np.sqrt(np.mean(error[good] ** 2))) if good.any() else float("nan"),
        bound(ratio_db), float(1.0 - good.mean()),
    )  # fmt: skip


def wire(distance: np.ndarray, amplitude: np.ndarray, resonance_hz: float = 40_000.0) -> np.ndarray:
    """Samples of one block: a pulse each slot over a way [m] with an amplitude, or over several.

    Args:
        distance: of the ways, shape (60,) or (60, ways).
        amplitude: of each way.
        resonance_hz: of the source.
    """
    ways = (len(SLOTS), 1, -1)
    field = SoundField(
        SLOTS, np.zeros(len(SLOTS), int), Paths(distance.reshape(ways), amplitude.reshape(ways)),
        SPEED, np.zeros(1), [Resonator(resonance_hz, RESONATOR[1])],
    )  # fmt: skip
    return field.samples(0, BLOCK_SAMPLES)[0]


def arrivals(detect: ArrivalDetector, samples: np.ndarray) -> Arrivals:
    """First arrivals of the pulses of a block."""
    bands = detect.splitter.split(samples)
    return detect.detect(bands.sound, bands.matched, SLOTS)
