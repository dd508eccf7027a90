"""The paper's filter: consistent where the model holds; missing ranges; Q and V count."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from mocap_jax.arm import WristFilterOptions, compensated, wrist_filter
from mocap_jax.errors import InputError

ANCHORS = np.array([[-0.7, -0.4], [1.3, -0.4], [1.3, 1.1], [-0.7, 1.1]])
ASIDE = np.full(4, 0.3)
OPTIONS = WristFilterOptions(step_sigma=0.005, range_sigma=0.003, start_sigma=0.02)


def _trial(seed: int, frames: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A random walk, its start as guessed, and ranges."""
    rng = np.random.default_rng(seed)
    start = np.array([0.3, 0.2])
    steps = OPTIONS.step_sigma * rng.normal(size=(frames, 2))
    steps[0] += OPTIONS.start_sigma * rng.normal(size=2)
    path = start + np.cumsum(steps, axis=0)
    ranges = np.sqrt(((path[:, None] - ANCHORS) ** 2).sum(-1) + ASIDE**2)
    return path, start, ranges + OPTIONS.range_sigma * rng.normal(size=ranges.shape)


def test_errors_are_as_large_as_claimed() -> None:
    nees = []
    for seed in range(60):
        path, start, ranges = _trial(seed)
        found = wrist_filter(ranges, ANCHORS, start, ASIDE, OPTIONS)
        e = path - np.asarray(found.position)
        nees.append(np.einsum("ti,tij,tj->t", e, np.linalg.inv(np.asarray(found.covariance)), e))
    assert 0.9 < np.mean(nees) / 2 < 1.1


def test_without_ranges_it_waits_and_is_less_sure() -> None:
    path, start, ranges = _trial(0)
    ranges[20:30] = np.nan
    ranges[30:, 2] = np.nan
    found = wrist_filter(ranges, ANCHORS, start, ASIDE, OPTIONS)
    position, P = np.asarray(found.position), np.asarray(found.covariance)
    np.testing.assert_allclose(position[29], position[19], atol=1e-12)
    np.testing.assert_allclose(P[29] - P[19], 10 * OPTIONS.step_sigma**2 * np.eye(2), atol=1e-12)
    assert np.abs(position[30:] - path[30:]).max() < 0.02


def test_the_likelihood_knows_the_noise() -> None:
    def told(step: float) -> float:
        options = WristFilterOptions(step_sigma=step, range_sigma=0.003, start_sigma=0.02)
        trials = (_trial(s) for s in range(10))
        return sum(
            float(wrist_filter(r, ANCHORS, start, ASIDE, options).log_likelihood)
            for _, start, r in trials
        )

    best = told(OPTIONS.step_sigma)
    assert best > told(OPTIONS.step_sigma / 2) and best > told(OPTIONS.step_sigma * 2)


def test_temperature_compensation_is_equation_1() -> None:
    np.testing.assert_allclose(compensated(0.01, 20.0), 0.01 * 20.05 * np.sqrt(293.15))
    # Half a degree is 0.85 mm on a metre.
    off = compensated(1 / 343.0, 20.5) - compensated(1 / 343.0, 20.0)
    np.testing.assert_allclose(off, 0.85e-3, rtol=0.02)


def test_wrong_options() -> None:
    with pytest.raises(InputError, match="step_sigma=0: must be above 0"):
        WristFilterOptions(step_sigma=0.0)
    with pytest.raises(InputError, match="scaling=-2"):
        WristFilterOptions(scaling=-2.0)
    assert jax.tree.leaves(OPTIONS) == [OPTIONS]
