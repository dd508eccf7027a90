"""The calibration of Vlasic 2007, section 4.3: sources and microphones at known distances.

Each of eight sources, whose resonances and delays differ, stands at 12 places before a microphone,
0.3 m to 0.9 m away and up to 45 degrees off its axis, 0.4 m above a table that reflects half the
amplitude. The wire has the simulator's ambient noise, its converter's, and random telemetry. One
pulse a place is measured. The paper names neither the number of places nor of pulses.
"""

from __future__ import annotations

import numpy as np

from checks.ranging_noise import SLOTS, SPEED, arrivals, wire
from mocap_jax.signals.telemetry.frame import BIT_RATE_HZ
from mocap_jax.signals.telemetry.line import voltage
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, DetectorOptions
from mocap_jax.signals.ultrasonic.calibration import OffsetCalibration, calibrate_offsets
from mocap_jax.signals.wire import BLOCK_SAMPLES
from mocap_jax.simulation.hearing import HearingFigures
from mocap_jax.simulation.raw import RawOptions
from mocap_jax.simulation.raw.noise import WireNoise
from mocap_jax.simulation.raw.transducer import SAMPLE_RATE_HZ

SOURCES, PLACES = 8, 12
_HEIGHT_M, _TABLE = 0.4, 0.5
_DETUNING_HZ, _DELAY_S = 200.0, 2e-5


def calibration(detector: str, seed: int) -> OffsetCalibration:
    """Offsets and left-out errors of one calibration."""
    rng, raw = np.random.default_rng(seed), RawOptions()
    options = DetectorOptions(detector=detector)
    detect = ArrivalDetector(options, speed=SPEED, reference=raw.reference, length=BLOCK_SAMPLES)
    measured, true, source = [], [], []
    for s in range(SOURCES):
        distance = rng.uniform(0.3, 0.9, len(SLOTS))
        found = arrivals(detect, _one_source(distance, rng, raw))
        excess = SPEED * _DELAY_S * rng.standard_normal()
        heard = np.flatnonzero(np.isfinite(found.delay))[:PLACES]
        measured.append(SPEED * found.delay[heard] + excess)
        true.append(distance[heard])
        source.append(np.full(len(heard), s))
    return calibrate_offsets(
        np.concatenate(measured), np.concatenate(true), np.concatenate(source), SOURCES
    )


def _one_source(distance: np.ndarray, rng: np.random.Generator, raw: RawOptions) -> np.ndarray:
    """Wire of a microphone: direct sound and the table's, noise, telemetry."""
    figures = HearingFigures()
    angle = np.radians(rng.uniform(0.0, 45.0, len(SLOTS)))
    beam = ((1.0 + np.cos(angle)) / 2.0) ** figures.beam
    around = np.sqrt(distance**2 + 4.0 * _HEIGHT_M**2)
    ways = np.stack([distance, around], axis=1)
    gain = raw.reference * beam[:, None] * np.array([1.0, _TABLE]) / ways
    samples = wire(ways, gain, 40_000.0 + _DETUNING_HZ * rng.standard_normal())
    noise = WireNoise(figures.noise * raw.reference, raw.converter_noise, 0.0, 1, rng)
    place = np.arange(BLOCK_SAMPLES) * (BIT_RATE_HZ / SAMPLE_RATE_HZ) - 0.5
    bits = rng.integers(0, 2, int(place[-1]) + 3).astype(np.uint8)
    return samples + noise.samples(0, BLOCK_SAMPLES)[0] + raw.telemetry * voltage(bits, place)
