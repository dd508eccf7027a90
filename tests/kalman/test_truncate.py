"""A belief cut off at a bound has the cut belief's moments."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.kalman import truncate


@pytest.mark.parametrize("room", [2.0, 0.3, 0.0, -0.7])
def test_moments_are_those_of_the_samples_within(room: float) -> None:
    P = np.array([[0.5, 0.2, -0.1], [0.2, 0.8, 0.3], [-0.1, 0.3, 0.6]])
    x = np.random.default_rng(0).multivariate_normal(np.zeros(3), P, 400_000)
    kept = x[x[:, 1] > -room]
    shift, covariance = truncate(jnp.asarray(P), jnp.asarray(1), jnp.asarray(room))
    np.testing.assert_allclose(shift, kept.mean(0), atol=0.01)
    np.testing.assert_allclose(covariance, np.cov(kept.T), atol=0.01)


def test_without_a_bound_or_far_within_it_nothing_changes() -> None:
    P = jnp.asarray([[0.5, 0.2], [0.2, 0.8]])
    for room in (jnp.inf, 20.0):
        shift, covariance = truncate(P, jnp.asarray(0), jnp.asarray(room))
        np.testing.assert_allclose(shift, 0.0, atol=1e-100)
        np.testing.assert_allclose(covariance, P, rtol=1e-12)


@pytest.mark.parametrize("room", [-5.0, -29.0, -31.0, -1e4])
def test_a_belief_wholly_beyond_comes_back_to_the_bound(room: float) -> None:
    P = jnp.asarray([[1.0, 0.3], [0.3, 0.8]])
    shift, covariance = truncate(P, jnp.asarray(0), jnp.asarray(room))
    assert 0 <= shift[0] + room < 0.25
    assert (np.linalg.eigvalsh(covariance) > 0).all()


@pytest.mark.parametrize("room", [0.4, -0.7, 20.0, np.inf])
def test_derivatives_are_those_of_differences(room: float) -> None:
    """Also without a bound, where nothing is cut."""
    P = np.array([[0.5, 0.2], [0.2, 0.8]])
    rng = np.random.default_rng(1)
    weights = jnp.asarray(rng.normal(size=6))

    def value(x: jax.Array) -> jax.Array:
        cut = truncate(x[:4].reshape(2, 2), jnp.asarray(1), x[4])
        return weights @ jnp.concatenate([cut[0], cut[1].ravel()])

    x, h = jnp.asarray([*P.ravel(), room]), 1e-6
    slope, expected = jax.grad(value)(x), []
    for i in range(5 if np.isfinite(room) else 4):
        there, back = (value(x.at[i].add(s)) for s in (h, -h))
        expected.append(float(there - back) / (2 * h))
    np.testing.assert_allclose(slope[: len(expected)], expected, atol=1e-7)
    assert np.isfinite(slope).all()
