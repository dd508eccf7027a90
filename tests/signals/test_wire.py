"""One wire from its first sample to its last."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.signals.ultrasonic.arrivals import DETECTORS, ArrivalDetector, DetectorOptions
from mocap_jax.signals.wire import BLOCK_SAMPLES, Emissions, WireDecoder

RATE = 150_000.0


@pytest.mark.parametrize("name", DETECTORS)
@pytest.mark.parametrize("more", [3000, 12_000, 30_000])
def test_what_is_left_at_the_end_has_the_noise_of_the_rest(name: str, more: int):
    """Noise alone: what fills the last block up is no silence in which noise would be a pulse."""
    detector = ArrivalDetector(
        DetectorOptions(detector=name), speed=343.0, reference=3000.0, length=BLOCK_SAMPLES
    )
    count = BLOCK_SAMPLES + more
    samples = np.rint(100.0 * np.random.default_rng(3).standard_normal(count)).astype(np.int16)
    time = np.arange(0.0, count / RATE, 0.008)
    pulses = Emissions(time, np.zeros(len(time), np.int64))
    wire = WireDecoder((detector,), 0.0, silent=True)
    wire.feed(samples, pulses)
    wire.finish(pulses)
    found = wire.arrivals()
    last = time[found.pulse] > 73_200 / RATE  # of the first block
    assert last.sum() <= 2, "a peak of 4 noise amplitudes in a slot of 40 is one in fifty"
    assert len(found.pulse) < 0.1 * len(time)


@pytest.mark.parametrize("more", [1500, 20_000])
def test_the_last_pulses_are_found_with_their_deviation(more: int):
    """A burst in each slot, to the end."""
    detector = ArrivalDetector(
        DetectorOptions(), speed=343.0, reference=3000.0, length=BLOCK_SAMPLES
    )
    count = BLOCK_SAMPLES + more
    t = np.arange(count) / RATE
    burst = (t % 0.008 > 0.003) & (t % 0.008 < 0.00325)
    noise = 40.0 * np.random.default_rng(4).standard_normal(count)
    samples = np.rint(noise + 3000.0 * burst * np.sin(2 * np.pi * 40_000 * t)).astype(np.int16)
    time = np.arange(0.0, count / RATE, 0.008)
    pulses = Emissions(time, np.zeros(len(time), np.int64))
    wire = WireDecoder((detector,), 0.0, silent=True)
    wire.feed(samples, pulses)
    wire.finish(pulses)
    found = wire.arrivals()
    whole = time + 0.008 <= count / RATE + 1e-9
    np.testing.assert_array_equal(found.pulse, np.flatnonzero(whole))
    assert np.ptp(found.delay) < 1e-5
    late = time[found.pulse] > 73_200 / RATE
    np.testing.assert_allclose(found.deviation[late], np.median(found.deviation), rtol=0.25)
