"""Detectors against the Cramer-Rao bound, the published chain written out, and ISO's table."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from mocap_jax.errors import InputError
from mocap_jax.signals.ultrasonic.air import absorption, speed_of_sound, temperature
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, DetectorOptions
from mocap_jax.signals.ultrasonic.bands import BandSplitter
from mocap_jax.signals.ultrasonic.burst import envelope
from mocap_jax.signals.ultrasonic.calibration import calibrate_offsets
from mocap_jax.signals.ultrasonic.distances import measure
from mocap_jax.signals.wire import BLOCK_SAMPLES
from mocap_jax.simulation.raw.transducer import PHASES, pulse_table

RATE, CARRIER, SPEED = 150_000.0, 40_000.0, 343.0
EMISSIONS = 1200 / RATE + 0.008 * np.arange(60)


def burst(time: np.ndarray, phase: float) -> np.ndarray:
    return (envelope(time) * np.exp(1j * (2 * np.pi * CARRIER * time + phase))).real


def noisy_block(noise: float, rng, amplitude: float = 1000.0, echoes=()) -> tuple:
    """A block of pulses at random delays with random phases."""
    samples = noise * rng.standard_normal(BLOCK_SAMPLES)
    delays = rng.uniform(0.002, 0.006, len(EMISSIONS))
    for begin in EMISSIONS + delays:
        phase = rng.uniform(0, 2 * np.pi)
        for late, share in ((0.0, 1.0), *echoes):
            first = int((begin + late) * RATE) - 4
            time = (first + np.arange(500)) / RATE - begin - late
            samples[first : first + 500] += share * amplitude * burst(time, phase)
    return samples, delays


def detector(name: str, reference: float = 3000.0) -> ArrivalDetector:
    options = DetectorOptions(detector=name)
    return ArrivalDetector(options, speed=SPEED, reference=reference, length=BLOCK_SAMPLES)


def detect(name: str, samples: np.ndarray, emissions: np.ndarray = EMISSIONS, **options):
    found = detector(name, **options)
    bands = found.splitter.split(samples)
    return found.detect(bands.sound, bands.matched, emissions)


def cramer_rao(amplitude: float, noise: float) -> float:
    """Bound of the distance's deviation [m]: time, amplitude and phase unknown, white noise."""
    time = np.arange(-300, 900) / RATE
    whole = lambda p: p[1] * burst(time - p[0], p[2])  # noqa: E731
    at, steps = np.array([1.3e-6, amplitude, 0.4]), (1e-9, 1e-3 * amplitude, 1e-5)
    J = np.stack([(whole(at + s * e) - whole(at - s * e)) / (2 * s)
                  for s, e in zip(steps, np.eye(3), strict=True)])  # fmt: skip
    return SPEED * noise * np.sqrt(np.linalg.inv(J @ J.T)[0, 0])


@pytest.mark.parametrize("noise", [20.0, 100.0, 250.0])
def test_matched_detector_reaches_the_cramer_rao_bound(noise: float):
    rng = np.random.default_rng(int(noise))
    errors = []
    for _ in range(3):
        samples, delays = noisy_block(noise, rng)
        errors.append(SPEED * (detect("matched", samples).delay - delays))
    rmse = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    assert 0.8 * cramer_rao(1000.0, noise) < rmse < 1.25 * cramer_rao(1000.0, noise)


def test_inflection_detector_stays_within_one_and_a_half_of_the_bound():
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(3):
        samples, delays = noisy_block(100.0, rng)
        errors.append(SPEED * (detect("inflection", samples).delay - delays))
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 1.5 * cramer_rao(1000.0, 100.0)


def test_inflection_is_that_of_the_published_chain():
    """Band-pass, square, low-pass at 30 kHz, steepest rise, all at 150 kHz."""
    samples, delays = noisy_block(0.0, np.random.default_rng(1))
    spectrum = np.fft.rfft(samples)
    off = np.abs(np.fft.rfftfreq(BLOCK_SAMPLES, 1 / RATE) - CARRIER)
    band = 0.5 + 0.5 * np.cos(np.pi * np.clip((off - 2500.0) / 500.0, 0, 1))
    narrow = np.fft.irfft(spectrum * band, BLOCK_SAMPLES)
    power = signal.sosfiltfilt(signal.butter(4, 30_000.0, fs=RATE, output="sos"), narrow**2)
    found = detect("inflection", samples)
    offset = detector("inflection").offset
    assert 15 < offset * RATE < 45  # "about 40 samples after the start of the pulse"
    for emission, delay, true in zip(EMISSIONS, found.delay, delays, strict=True):
        slot = slice(round((emission + true) * RATE) - 20, round((emission + true) * RATE) + 60)
        steepest = slot.start + np.argmax(np.diff(power[slot])) + 0.5
        assert abs((emission + delay + offset) * RATE - steepest) < 0.75


def test_the_telemetry_of_the_wire_does_not_disturb_the_sound():
    rng = np.random.default_rng(2)
    samples, delays = noisy_block(0.0, rng)
    time = np.arange(BLOCK_SAMPLES) / RATE
    tones = 800 * np.sin(2 * np.pi * 6440.0 * time) + 400 * np.sin(2 * np.pi * 12_880.0 * time)
    found = detect("matched", samples + tones)
    assert np.abs(SPEED * (found.delay - delays)).max() < 1e-4


@pytest.mark.parametrize("name", ["matched", "inflection"])
@pytest.mark.parametrize("noise", [20.0, 100.0])
def test_deviation_of_arrivals_is_foretold(name: str, noise: float):
    """It may be some 20 % too large, since the noise is taken from between and under the pulses."""
    rng, errors, foretold = np.random.default_rng(7), [], []
    for _ in range(3):
        samples, delays = noisy_block(noise, rng)
        found = detect(name, samples)
        errors.append(found.delay - delays)
        foretold.append(found.deviation)
    rmse = np.sqrt(np.mean(np.square(errors)))
    assert 0.9 * rmse < np.sqrt(np.mean(np.square(foretold))) < 1.4 * rmse


@pytest.mark.parametrize("name", ["matched", "inflection"])
def test_first_arrival_is_taken_although_an_echo_is_louder(name: str):
    samples, delays = noisy_block(5.0, np.random.default_rng(3), echoes=((0.0012, 1.6),))
    found = detect(name, samples)
    assert np.abs(SPEED * (found.delay - delays)).max() < 0.01


@pytest.mark.parametrize("name", ["matched", "inflection"])
def test_a_late_echo_of_the_pulse_before_is_passed_over(name: str):
    """A faint early sound is not near enough to be direct; the louder one behind it is."""
    rng = np.random.default_rng(4)
    samples, delays = noisy_block(5.0, rng, amplitude=2500.0)
    early = samples.copy()
    for begin in EMISSIONS + 0.0009:  # 0.31 m in this slot, 3.05 m from the source before
        first = int(begin * RATE)
        early[first : first + 500] += 550.0 * burst((first + np.arange(500)) / RATE - begin, 0.0)
    found = detect(name, early)
    np.testing.assert_allclose(SPEED * found.delay, SPEED * delays, atol=0.01)


@pytest.mark.parametrize("name", ["matched", "inflection"])
def test_silence_and_noise_are_not_heard(name: str):
    assert np.isnan(detect(name, np.zeros(BLOCK_SAMPLES)).delay).all()
    noise = 100.0 * np.random.default_rng(5).standard_normal(BLOCK_SAMPLES)
    assert np.isnan(detect(name, noise).delay).mean() > 0.9


@pytest.mark.parametrize("name", ["matched", "inflection"])
def test_a_block_without_pulses_has_no_arrivals(name: str):
    samples = np.random.default_rng(6).standard_normal(BLOCK_SAMPLES)
    assert detect(name, samples, emissions=np.zeros(0)).delay.shape == (0,)


def test_unknown_detector_names_the_valid_ones():
    with pytest.raises(InputError, match="valid: matched, inflection"):
        DetectorOptions(detector="peak")


def test_simulated_pulse_is_that_of_the_differential_equation():
    """The detector's envelope leaves out twice the carrier: 2 % of a resonator of Q 20."""
    table = pulse_table(CARRIER, 20.0)
    time = (np.arange(table.shape[1])[None] + np.arange(PHASES)[:, None] / PHASES) / RATE
    expected = burst(time, np.pi)  # at resonance, a quarter turn behind the drive
    best = (table * expected).sum() / np.sqrt((table**2).sum() * (expected**2).sum())
    assert best > 0.999


def test_bands_separate_sound_and_telemetry():
    splitter = BandSplitter(BLOCK_SAMPLES)
    time = np.arange(BLOCK_SAMPLES) / RATE
    both = 100 * np.cos(2 * np.pi * 40_500.0 * time) + 50 * np.cos(2 * np.pi * 5000.0 * time)
    bands = splitter.split(both)
    np.testing.assert_allclose(np.abs(bands.sound)[300:-300], 100, rtol=1e-3)
    expected = 50 * np.cos(2 * np.pi * 5000.0 * time[::2])
    np.testing.assert_allclose(bands.telemetry[300:-300], expected[300:-300], atol=0.05)


def test_absorption_matches_the_table_of_iso_9613():
    # ISO 9613-2, table 2: 20 degrees Celsius, 70 % humidity, dB/km at the octaves.
    octaves = 1000.0 * 10.0 ** (0.3 * np.arange(-4, 4))
    expected = [0.1, 0.3, 1.1, 2.8, 5.0, 9.0, 22.9, 76.6]
    np.testing.assert_allclose(1e3 * absorption(octaves, 20.0, 70.0), expected, atol=0.06)
    assert 1.0 < absorption(CARRIER, 20.0, 50.0) < 1.6


def test_speed_of_sound_in_humid_air():
    # National Physical Laboratory's calculator (Cramer 1993), 20 degrees Celsius, 101.325 kPa.
    for humidity, faster in ((0.0, 0.0), (50.0, 0.63), (100.0, 1.27)):
        assert speed_of_sound(20.0, humidity) - speed_of_sound(20.0) == pytest.approx(
            faster, abs=0.08
        )


def test_speed_of_sound_and_temperature_are_inverse():
    assert speed_of_sound(20.0) == pytest.approx(343.29, abs=0.01)
    np.testing.assert_allclose(temperature(speed_of_sound([0.0, 25.0])), [0.0, 25.0], atol=1e-9)


def one_pulse(delay: float, **options):
    """Measure two receivers, one of which has a poor signal."""
    both = np.full((1, 2), delay)
    return measure(
        np.zeros(1), np.zeros(1, int), both, np.ones((1, 2)), np.full(1, SPEED), np.zeros(1),
        **options,
    )  # fmt: skip


def test_confidence_is_nominal_over_expected_deviation():
    noise = np.array([[0.0, 0.0025 / SPEED * np.sqrt(3.0)]])
    found = one_pulse(1.0 / SPEED, deviation=noise, nominal=0.0025)
    np.testing.assert_allclose(found.confidence, [[1.0, 0.5]])
    np.testing.assert_array_equal(one_pulse(1.0 / SPEED).confidence, [[1.0, 1.0]])


def test_distances_beyond_a_pairs_reach_are_not_believed():
    found = one_pulse(1.0 / SPEED, farthest=np.array([[1.1, 0.9]]))
    np.testing.assert_array_equal(found.confidence, [[1.0, 0.0]])
    assert np.isnan(found.distance[0, 1])


def test_offsets_and_left_out_errors():
    rng = np.random.default_rng(0)
    source = np.repeat([0, 1, 3], 12)
    true = rng.uniform(0.3, 0.9, len(source))
    offset = np.array([0.091, 0.088, np.nan, 0.095])
    error = 0.002 * rng.standard_normal(len(source))
    out = calibrate_offsets(true + offset[source] + error, true, source, 4)
    np.testing.assert_allclose(out.offset, offset, atol=0.002)
    for i in (0, 17, 35):  # left out by hand
        others = (source == source[i]) & (np.arange(len(source)) != i)
        expected = (offset[source[i]] + error[i]) - (offset[source] + error)[others].mean()
        assert out.left_out_error[i] == pytest.approx(expected, abs=1e-12)
    assert 0.0005 < out.mean_error < 0.004
    with pytest.raises(InputError, match="not finite"):
        calibrate_offsets(true * np.nan, true, source, 4)
