"""Derivatives of an estimate whose boards move on the skin."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from mocap_jax.estimate import NoiseOptions, OptimiseOptions, PriorOptions
from mocap_jax.estimate.derivatives import Differentiable, Parameters, differentiable
from tests.estimate.synthetic import record, small_body
from tests.estimate.test_derivatives import RESOLUTION, leaves, moved, slope_of

NAMES = (
    ".measurements.accelerometer",
    ".figures.gyroscope",
    ".figures.pose_sigma",
    ".figures.smoothness_density",
    ".figures.rest_sigma",
    ".body.site_pos",
)
"""One of each kind; the boards' places are those of the segments that float."""


@pytest.fixture(scope="module")
def estimate() -> Differentiable:
    options = OptimiseOptions(
        prior=PriorOptions(skin_sigma=0.005), noise=NoiseOptions(adapt=False), covariance=False
    )
    return differentiable(record(seconds=2.5, rate_hz=60.0), options=options)


@pytest.mark.slow
def test_poses_are_those_of_the_body_itself(estimate: Differentiable) -> None:
    found = estimate(estimate.parameters).q
    assert found.shape[1] == small_body().nq
    np.testing.assert_allclose(found, estimate.solution.trajectory.q, atol=1e-3)


@pytest.mark.slow
def test_gradient_is_that_of_estimates_solved_again(estimate: Differentiable) -> None:
    rng = np.random.default_rng(0)
    weights = rng.normal(size=np.shape(estimate.solution.trajectory.q))
    value = lambda p: (weights * estimate(p).q).sum()  # noqa: E731
    slopes, base = leaves(jax.grad(value)(estimate.parameters)), leaves(estimate.parameters)

    def along(name: str, direction: np.ndarray, h: float) -> float:
        p: Parameters = moved(estimate.parameters, name, h * direction)
        return float(value(p))

    for name in NAMES:
        start = np.asarray(base[name])
        direction = rng.normal(size=start.shape) * (np.abs(start).max() or 1.0)
        size = 2e-4 if name.startswith((".body", ".measurements")) else 0.02
        expected = slope_of(lambda h, n=name, d=direction: along(n, d, h), size)
        got = float((slopes[name] * direction).sum())
        assert abs(got - expected) <= 1e-4 * abs(expected) + RESOLUTION / size, name
