"""Bursts of several frequencies on one wire: what is heard of which, and what is as it was."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pytest
import scipy.fft
from scipy import signal

from mocap_jax.decoding import decode_raw
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, DetectorOptions
from mocap_jax.signals.ultrasonic.bands import BandSplitter
from mocap_jax.signals.ultrasonic.burst import Transducer, envelope
from mocap_jax.signals.wire import BLOCK_SAMPLES
from mocap_jax.simulation import SimulationOptions
from mocap_jax.simulation.raw import simulate_raw
from mocap_jax.simulation.raw.amplifier import gain
from mocap_jax.simulation.raw.paths import Paths
from mocap_jax.simulation.raw.sound import Resonator, SoundField
from mocap_jax.simulation.raw.transducer import PHASES, pulse_samples, pulse_table

RATE, SPEED = 150_000.0, 343.0
OPTIONS = SimulationOptions(rest_s=0.3, blend_s=0.5)
AT_40_KHZ = "536692e321e2bea93090b58a7ed40b591edba0634a4d2c364fad4f40e0c89221"
"""SHA-256 of samples that the simulation made when it knew 40 kHz and no anchors."""


def test_the_papers_wires_are_what_they_were_bit_for_bit(motion, suit):
    raw = simulate_raw(motion, profile="paper", suit=suit, options=OPTIONS, seed=2)
    chunk = next(samples for first, samples in raw.chunks() if first == 300_000)
    assert hashlib.sha256(chunk.tobytes()).hexdigest() == AT_40_KHZ
    assert raw.box.source_frequency_hz == {}


def test_a_frequency_that_is_silent_changes_no_distance(motion, suit, tmp_path):
    """A second detector stands beside the first and finds none of its pulses."""
    raw = simulate_raw(motion, profile="paper", suit=suit, options=OPTIONS, seed=2)
    other = replace(raw, _frequencies=(40_000.0, 33_000.0))
    back = raw.pulse_source == 1  # its pulses are not named
    fewer = {"pulse_time": raw.pulse_time[~back], "pulse_source": raw.pulse_source[~back]}
    replace(raw, **fewer).write(tmp_path / "one.raw.mcap")
    replace(other, **fewer).write(tmp_path / "two.raw.mcap")
    names = ("one", "two")
    one, two = (decode_raw(tmp_path / f"{n}.raw.mcap").recording.ranges for n in names)
    assert len(one.time) > 50
    np.testing.assert_array_equal(one.distance, two.distance)
    np.testing.assert_array_equal(one.confidence, two.confidence)
    told = [b"source_frequency_hz" in (tmp_path / f"{n}.raw.mcap").read_bytes() for n in names]
    assert told == [False, True], "older readers refuse the entry: files without need are as before"


def test_the_filters_of_40_khz_are_what_they_were_bit_for_bit():
    """Written out as they were when there was one carrier."""
    samples = np.random.default_rng(0).integers(-3000, 3000, BLOCK_SAMPLES).astype(np.int16)
    spectrum, count = scipy.fft.rfft(samples.astype(np.float32)), BLOCK_SAMPLES // 8
    low, middle, high = (20_480 + k * count // 2 for k in (-1, 0, 1))
    about = 2.0 / 8 * np.concatenate([spectrum[middle:high], spectrum[low:middle]])
    splitter = BandSplitter(BLOCK_SAMPLES)
    bands = splitter.split(samples)
    np.testing.assert_array_equal(bands.sound, scipy.fft.ifft(about * splitter._narrow))
    np.testing.assert_array_equal(bands.matched, scipy.fft.ifft(about * splitter._match))


def sound(resonators: list[Resonator], source: list[int]) -> np.ndarray:
    """Sources that sound at the same time, 1 m before one microphone."""
    ways = np.ones((len(source), 1, 1))
    field = SoundField(
        np.full(len(source), 0.1), np.array(source), Paths(ways, ways), SPEED,
        np.zeros(len(resonators)), resonators,
    )  # fmt: skip
    return field.samples(0, BLOCK_SAMPLES)[0]


def test_a_microphone_hears_all_frequencies_at_once():
    both = [Resonator(40_000.0, 20.0), Resonator(33_000.0, 20.0, 33_000.0)]
    apart = sound(both, [0]) + sound(both, [1])
    np.testing.assert_allclose(sound(both, [0, 1]), apart, atol=1e-7)
    assert min(np.abs(sound(both, [i])).max() for i in (0, 1)) > 0.3


@pytest.mark.parametrize("name", ["matched", "inflection"])
@pytest.mark.parametrize(
    ("own", "other", "weakest", "loudest"),
    [(40e3, 33e3, -45, -28), (33e3, 40e3, -45, -25), (40e3, 47e3, -45, -25), (40e3, 37e3, -16, -5)],
)
def test_what_passes_the_filter_of_another_frequency(name, own, other, weakest, loudest):
    """Little of what is 7 kHz off, but something; much of what is 3 kHz off [dB]."""
    options = DetectorOptions(detector=name, transducer=Transducer(own, 20.0, own))
    detector = ArrivalDetector(options, speed=SPEED, reference=1000.0, length=BLOCK_SAMPLES)
    samples = 1000.0 * sound([Resonator(other, 20.0, other)], [0])
    emission = np.array([0.1])
    found = detector.detect(*_bands(detector, samples), emission)
    assert weakest < 20 * np.log10(found.amplitude[0] / 1000.0) < loudest
    right = 1000.0 * sound([Resonator(own, 20.0, own)], [0])
    found = detector.detect(*_bands(detector, right), emission)
    assert 20 * np.log10(found.amplitude[0] / 1000.0) == pytest.approx(0.0, abs=0.3)
    assert SPEED * found.delay[0] == pytest.approx(1.0, abs=0.002)


def _bands(detector: ArrivalDetector, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    bands = detector.splitter.split(samples)
    return bands.sound, bands.matched


@pytest.mark.parametrize("drive", [27_000.0, 33_000.0, 47_000.0])
def test_pulses_of_other_frequencies_are_those_of_the_differential_equation(drive: float):
    table = pulse_table(drive, 20.0, drive, pulse_samples(drive))
    time = (np.arange(table.shape[1])[None] + np.arange(PHASES)[:, None] / PHASES) / RATE
    slow = envelope(time, Transducer(drive, 20.0, drive))
    expected = (slow * np.exp(1j * (2 * np.pi * drive * time + np.pi))).real
    best = (table * expected).sum() / np.sqrt((table**2).sum() * (expected**2).sum())
    assert best > 0.999
    assert np.abs(table[:, -10:]).max() < 2e-5, "rung down"


def test_the_amplifier_passes_its_band():
    assert gain(40_000.0) == 1.0
    assert gain(33_000.0) == pytest.approx(1.0, abs=0.03)
    for edge in (25_000.0, 55_000.0):
        assert 20 * np.log10(gain(edge)) == pytest.approx(-3.0, abs=0.1)
    b, a = signal.butter(2, (25_000.0, 55_000.0), "bandpass", fs=RATE)
    _, response = signal.freqz(b, a, [47_000.0, 40_000.0], fs=RATE)
    assert gain(47_000.0) == pytest.approx(abs(response[0]) / abs(response[1]), rel=1e-9)
