"""Allan deviation against its definition, closed forms and AllanTools; processes read off it."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.calibration.allan import (
    AllanFit,
    allan_deviation,
    averaging_lengths,
    fit_processes,
)

STEP = 0.01
WHITE, WALK, FLOOR = 2e-3, 1e-3, 1e-2


def white(n: int, channels: int, seed: int = 0) -> np.ndarray:
    """Means over each step of white noise with N = WHITE."""
    return WHITE / np.sqrt(STEP) * np.random.default_rng(seed).standard_normal((n, channels))


def walk(n: int, channels: int, seed: int = 1) -> np.ndarray:
    """Random walk with K = WALK."""
    steps = np.random.default_rng(seed).standard_normal((n, channels))
    return np.cumsum(WALK * np.sqrt(STEP) * steps, axis=0)


def test_a_naive_double_loop_gives_the_same() -> None:
    values = white(40, 2) + walk(40, 2) + 9.81
    curve = allan_deviation(values, STEP, np.array([1, 3, 8]))
    for row, m in enumerate((1, 3, 8)):
        squares = []
        for k in range(len(values) - 2 * m + 1):
            first, second = values[k : k + m].mean(axis=0), values[k + m : k + 2 * m].mean(axis=0)
            squares.append((second - first) ** 2 / 2)
        np.testing.assert_allclose(curve.deviation[row], np.sqrt(np.mean(squares, axis=0)))
        assert curve.tau[row] == m * STEP


def test_closed_forms() -> None:
    # A ramp of slope a: sigma = a tau / sqrt(2) (drift; IEEE Std 952, C.1.5).
    ramp = 3.0 * STEP * np.arange(2000)[:, None]
    curve = allan_deviation(ramp, STEP)
    np.testing.assert_allclose(curve.deviation[:, 0], 3.0 * curve.tau / np.sqrt(2), rtol=1e-9)
    assert np.abs(allan_deviation(np.full((50, 1), 9.81), STEP).deviation).max() < 1e-12


def test_white_noise_and_random_walk_have_their_slopes() -> None:
    lengths = np.array([1, 4, 16, 64, 256])
    curve = allan_deviation(white(40_000, 30), STEP, lengths)
    mean = np.sqrt((curve.deviation**2).mean(axis=1))
    error = curve.relative_sigma / np.sqrt(30)
    assert (np.abs(mean / (WHITE / np.sqrt(curve.tau)) - 1) < 4 * error).all()
    curve = allan_deviation(walk(40_000, 30), STEP, lengths)
    mean = np.sqrt((curve.deviation**2).mean(axis=1))
    # Sampled values, not means over the interval: exact for tau = m steps (Riley 2008, 5.2.4).
    exact = WALK * np.sqrt(curve.tau / 3 * (1 + 0.5 / lengths**2))
    assert (np.abs(mean / exact - 1) < 5 * error).all()


def test_degrees_of_freedom_are_those_of_white_noise() -> None:
    curve = allan_deviation(white(3000, 400), STEP)
    spread = curve.deviation.std(axis=1) / curve.deviation.mean(axis=1)
    np.testing.assert_allclose(spread, curve.relative_sigma, rtol=0.5)
    assert np.abs(np.log(spread / curve.relative_sigma)).mean() < 0.2


def test_processes_are_found_with_honest_deviations() -> None:
    values = white(20_000, 60, 2) + walk(20_000, 60, 3)
    fit = fit_processes(allan_deviation(values, STEP))
    seen = fit.random_walk > 0
    assert seen.mean() > 0.9
    assert np.abs(fit.white / WHITE - 1).max() < 0.05
    assert abs(fit.random_walk[seen].mean() / WALK - 1) < 0.1
    for found, sigma, true in (
        (fit.white, fit.sigma[0], WHITE),
        (fit.random_walk[seen], fit.sigma[2][seen], WALK),
    ):
        assert 0.5 < np.sqrt((((found - true) / sigma) ** 2).mean()) < 1.5


def test_processes_that_are_not_there_are_not_seen() -> None:
    fit = fit_processes(allan_deviation(white(20_000, 60), STEP))
    for size in (fit.instability, fit.random_walk, fit.quantisation):
        assert (size > 0).mean() < 0.1
    np.testing.assert_allclose(fit.white, WHITE, rtol=0.03)


def test_flicker_and_round_off_are_told_from_the_rest() -> None:
    values = white(60_000, 12) + flicker(60_000, 12)
    fit = fit_processes(allan_deviation(values, STEP))
    assert (fit.instability > 0).all()
    assert abs(np.median(fit.instability) / FLOOR - 1) < 0.1
    # Round-off whose rest is carried over: the integral is right to one step.
    fine = np.cumsum(white(20_000, 6) + 0.123, axis=0)
    rounded = np.diff(np.round(fine / 0.1) * 0.1, axis=0, prepend=0)
    fit = fit_processes(allan_deviation(rounded, STEP))
    np.testing.assert_allclose(fit.quantisation, 0.1 / np.sqrt(12) * STEP, rtol=0.1)


def flicker(n: int, channels: int) -> np.ndarray:
    """Noise of two-sided spectral density B^2 / (2 pi f), shaped in the frequency domain."""
    spectrum = np.fft.rfft(np.random.default_rng(4).standard_normal((4 * n, channels)), axis=0)
    frequency = np.fft.rfftfreq(4 * n, STEP)
    frequency[0] = np.inf
    # White noise of deviation 1 has the two-sided density STEP.
    density = FLOOR**2 / (2 * np.pi * frequency)
    shaped = spectrum * np.sqrt(density / STEP)[:, None]
    return np.fft.irfft(shaped, axis=0)[:n]


def test_the_fitted_curve_is_the_sum_of_its_processes() -> None:
    one = lambda x: np.array([x])  # noqa: E731
    fit = AllanFit(one(1.0), one(2.0), one(3.0), one(4.0), np.zeros((4, 1)))
    tau = np.array([0.5, 2.0])
    expected = 1 / tau + 2 * np.log(2) / np.pi * 4 + 9 * tau / 3 + 3 * 16 / tau**2
    np.testing.assert_allclose(fit.deviation(tau)[:, 0] ** 2, expected)


def test_averaging_lengths_reach_a_fifth_of_the_recording() -> None:
    assert list(averaging_lengths(100)) == [1, 2, 4, 8, 16]
    fine = averaging_lengths(10_000, per_decade=10)
    assert fine[0] == 1 and fine[-1] == 2000 and (np.diff(fine) > 0).all()
    assert list(averaging_lengths(3, per_decade=10)) == [1]


def test_allantools_gives_the_same() -> None:
    allantools = pytest.importorskip("allantools", reason="AllanTools is not installed")
    values = white(5000, 1) + walk(5000, 1)
    curve = allan_deviation(values, STEP)
    tau, deviation, _, _ = allantools.oadev(
        values[:, 0], rate=1 / STEP, data_type="freq", taus=curve.tau
    )
    np.testing.assert_allclose(tau, curve.tau)
    np.testing.assert_allclose(deviation, curve.deviation[:, 0], rtol=1e-9)
