"""Conjugate gradients within a radius against dense algebra."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.estimate.derivatives.objective import Step
from mocap_jax.estimate.derivatives.trust_region import Descent, descend

T, D, M = 5, 3, 4
N = T * D + M


class Dense(NamedTuple):
    """A preconditioner from a dense matrix."""

    matrix: jax.Array

    def solve(self, v: Step) -> Step:
        return unflat(jnp.linalg.solve(self.matrix, flat(v)))


def flat(v: Step) -> jax.Array:
    return jnp.concatenate([v.x.ravel(), v.z])


def unflat(v: jax.Array) -> Step:
    return Step(v[: T * D].reshape(T, D), v[T * D :])


def problem(lowest: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hessian with a lowest eigenvalue relative to the preconditioner's, that, and a gradient."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(N, N)) + 4 * np.eye(N)
    turn = np.linalg.qr(rng.normal(size=(N, N)))[0]
    values = np.linspace(1, 3, N)
    values[0] = lowest
    return root.T @ turn @ np.diag(values) @ turn.T @ root, root.T @ root, rng.normal(size=N)


def run(H: np.ndarray, P: np.ndarray, g: np.ndarray, radius: float, most: int = 200) -> Descent:
    return descend(
        lambda v: unflat(jnp.asarray(H) @ flat(v)), unflat(jnp.asarray(g)),
        Dense(jnp.asarray(P)), radius, 1e-13, most,
    )  # fmt: skip


@pytest.mark.parametrize("radius", [np.inf, 1e6])
def test_it_solves_linear_equations(radius: float) -> None:
    H, P, g = problem(0.3)
    found = run(H, P, g, radius)
    x = np.asarray(flat(found.step))
    np.testing.assert_allclose(H @ x, -g, atol=1e-10)
    assert bool(found.inside)
    assert float(found.decrease) == pytest.approx(-(g @ x + x @ H @ x / 2), rel=1e-10)
    assert float(found.square) == pytest.approx(x @ P @ x, rel=1e-10)


@pytest.mark.parametrize("lowest", [0.3, -0.5])
def test_it_stays_within_the_radius_and_descends(lowest: float) -> None:
    H, P, g = problem(lowest)
    radius = 0.05
    found = run(H, P, g, radius)
    x = np.asarray(flat(found.step))
    assert not bool(found.inside)
    assert np.sqrt(x @ P @ x) == pytest.approx(radius, rel=1e-9)
    decrease = -(g @ x + x @ H @ x / 2)
    assert float(found.decrease) == pytest.approx(decrease, rel=1e-9)
    steepest = -np.linalg.solve(P, g)
    steepest *= radius / np.sqrt(steepest @ P @ steepest)
    assert decrease >= -(g @ steepest + steepest @ H @ steepest / 2) - 1e-12


def test_negative_curvature_without_a_radius_is_no_solution() -> None:
    H, P, g = problem(-0.5)
    found = run(H, P, g, np.inf)
    assert not bool(found.inside)
    assert not np.isfinite(flat(found.step)).all()


def test_no_gradient_no_step() -> None:
    H, P, _ = problem(0.3)
    found = run(H, P, np.zeros(N), 1.0)
    assert not np.asarray(flat(found.step)).any()
    assert int(found.iteration) == 0
