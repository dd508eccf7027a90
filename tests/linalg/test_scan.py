"""The scan solver against dense linear algebra, and its derivative."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.linalg import scan_factor, scan_solve


@pytest.mark.parametrize(("t", "d", "b"), [(7, 3, 2), (5, 2, 3), (6, 4, 1), (1, 3, 2)])
def test_solve_equals_dense(t: int, d: int, b: int, random_arrow) -> None:
    dense, lower, _, _ = random_arrow(t, d, b, 0)
    rhs = np.random.default_rng(3).normal(size=(t, d))
    x = scan_solve(scan_factor(jnp.asarray(lower)), jnp.asarray(rhs))
    np.testing.assert_allclose(x.ravel(), np.linalg.solve(dense, rhs.ravel()), rtol=1e-9)


def test_derivative_equals_central_differences(random_arrow) -> None:
    _, lower, _, _ = random_arrow(5, 2, 2, 0)
    rhs = jnp.asarray(np.random.default_rng(4).normal(size=(5, 2)))
    shape = jnp.asarray(np.random.default_rng(5).normal(size=5))

    def value(s: jax.Array) -> jax.Array:
        scaled = jnp.asarray(lower).at[:, 0].add(s * shape[:, None, None] ** 2 * jnp.eye(2))
        return (scan_solve(scan_factor(scaled), rhs) ** 2).sum()

    slope = (value(1e-5) - value(-1e-5)) / 2e-5
    np.testing.assert_allclose(jax.grad(value)(0.0), slope, rtol=1e-6)


def test_batches_by_vmap(random_arrow) -> None:
    _, lower, _, _ = random_arrow(4, 2, 2, 0)
    stack = jnp.stack([jnp.asarray(lower), 2 * jnp.asarray(lower)])
    rhs = jnp.ones((2, 4, 2))
    x = jax.vmap(lambda a, r: scan_solve(scan_factor(a), r))(stack, rhs)
    np.testing.assert_allclose(x[0], 2 * x[1], rtol=1e-10)
