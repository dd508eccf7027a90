"""The unscented filter: the textbook's sums; the Kalman filter where all is linear."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.kalman import (
    Dynamics,
    SigmaPoints,
    State,
    predict_unscented,
    process_noise,
    unscented_moments,
    update,
    update_unscented,
    vector_space,
)

NV, STEP = 2, 0.05
FLAT, POINTS = vector_space(), SigmaPoints()


def _covariance(n: int, seed: int) -> np.ndarray:
    root = np.random.default_rng(seed).normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


def _weighted_sums(f, P: np.ndarray, alpha: float, beta: float) -> tuple[np.ndarray, ...]:
    """The scaled unscented transform as printed, kappa = 0."""
    n = len(P)
    scale = alpha**2 * n
    L = np.linalg.cholesky(scale * P)
    x = np.concatenate([np.zeros((1, n)), L.T, -L.T])
    w = np.full(2 * n + 1, 1 / (2 * scale))
    w[0] = 1 - n / scale
    wc = w.copy()
    wc[0] += 1 - alpha**2 + beta
    y = np.array([f(p) for p in x])
    mean = w @ y
    return mean, (wc[:, None] * (y - mean)).T @ (y - mean), (wc[:, None] * x).T @ (y - mean)


@pytest.mark.parametrize(("spread", "beta"), [(3**0.5, None), (3**0.5, 2.0), (0.3, 2.0)])
def test_moments_are_the_weighted_sums(spread: float, beta: float | None) -> None:
    P, f = _covariance(5, 1), lambda x: jnp.stack([jnp.sin(x[0]) * x[1], x[2] ** 2, x[3] + x[4]])
    found = unscented_moments(f, jnp.asarray(P), SigmaPoints(spread, beta))
    expected = _weighted_sums(
        lambda x: np.asarray(f(x)), P, spread / 5**0.5, spread**2 / 5 if beta is None else beta
    )
    for ours, theirs in zip(found, expected, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-8)


def test_leading_columns_are_all_where_no_others_count() -> None:
    P, f = jnp.asarray(_covariance(6, 2)), lambda x: jnp.stack([jnp.cos(x[0]), x[1] * x[0]])
    for whole, part in zip(
        unscented_moments(f, P, POINTS), unscented_moments(f, P, POINTS, columns=2), strict=True
    ):
        np.testing.assert_allclose(part, whole, atol=1e-12)


@pytest.mark.parametrize("spread", [1.0, 2**0.5, 3**0.5])
def test_moments_of_a_sum_of_squares(spread: float) -> None:
    """Mean s^2 n, variance 2 s^4 n; the latter is stated as (spread)^2 s^4 n."""
    n, variance = 5, 0.49
    square = lambda x: (x**2).sum(keepdims=True)  # noqa: E731
    found = unscented_moments(square, variance * jnp.eye(n), SigmaPoints(spread))
    np.testing.assert_allclose(found.mean, [n * variance], rtol=1e-12)
    np.testing.assert_allclose(found.covariance, [[n * spread**2 * variance**2]], rtol=1e-12)


@pytest.mark.parametrize("process", ["white_jerk", "paper", "euler"])
def test_on_a_linear_problem_it_is_the_kalman_filter(process: str) -> None:
    rng, n = np.random.default_rng(3), 3 * NV
    noise = process_noise(process, jnp.asarray(STEP), jnp.array([2.0, 0.5]))
    dynamics = Dynamics(jnp.asarray(STEP), noise)
    eye, o = np.eye(NV), np.zeros((NV, NV))
    corner = o if process == "euler" else eye * STEP**2 / 2
    F = np.block([[eye, eye * STEP, corner], [o, eye, eye * STEP], [o, o, eye]])
    Q = np.zeros((3, NV, 3, NV))
    for k in range(NV):
        Q[:, k, :, k] = noise[:, :, k]
    Q = Q.reshape(n, n)
    m, P = rng.normal(size=n), _covariance(n, 4)
    state = State(*jnp.asarray(m).reshape(3, NV), jnp.asarray(P))
    for _ in range(20):
        m, P = F @ m, F @ P @ F.T + Q
        state = predict_unscented(FLAT, process, dynamics, state, POINTS)
        H, z, R = rng.normal(size=(3, n)), rng.normal(size=3), rng.uniform(0.1, 1.0, 3)
        K = P @ H[:2].T @ np.linalg.inv(H[:2] @ P @ H[:2].T + np.diag(R[:2]))
        m, P = m + K @ (z[:2] - H[:2] @ m), (np.eye(n) - K @ H[:2]) @ P
        z[2] = np.nan  # absent
        state, seen = update_unscented(
            FLAT, state, lambda s, z=z, H=H: z - H @ jnp.concatenate(s[:3]), jnp.asarray(R),
            jnp.array([True, True, False]), POINTS,
        )  # fmt: skip
        assert seen.accepted
        np.testing.assert_allclose(jnp.concatenate(state[:3]), m, atol=1e-9)
        np.testing.assert_allclose(state.covariance, P, atol=1e-9)


def test_a_curved_measurement_leaves_it_as_unsure_as_it_should_be() -> None:
    """A range across a wide prior: derivatives claim far too much, sigma points do not."""
    anchor, sigma, noise, runs = jnp.array([0.3, 0.0]), 0.15, 0.003, 400
    P = jnp.diag(jnp.array([sigma, sigma, 1, 1, 1, 1]) ** 2)
    start = State(jnp.zeros(2), jnp.zeros(2), jnp.zeros(2), P)
    reach = lambda q: jnp.linalg.norm(q - anchor)  # noqa: E731
    one = jnp.array([True])

    def nees(key: jax.Array, points: bool) -> jax.Array:
        at, error = jax.random.split(key)
        truth = sigma * jax.random.normal(at, (2,))
        z = reach(truth) + noise * jax.random.normal(error)
        residual = lambda s: (z - reach(s.q))[None]  # noqa: E731
        if points:
            state, _ = update_unscented(FLAT, start, residual, jnp.array([noise**2]), one, POINTS)
        else:
            H = jax.jacobian(lambda q: reach(q)[None])(start.q)
            state, _ = update(FLAT, start, H, residual(start), jnp.array([noise**2]), one)
        e = truth - state.q
        return e @ jnp.linalg.solve(state.covariance[:2, :2], e) / 2

    keys = jax.random.split(jax.random.PRNGKey(0), runs)
    linear, unscented = (float(jax.vmap(lambda k, p=p: nees(k, p))(keys).mean()) for p in (0, 1))
    assert linear > 50
    assert 0.5 < unscented < 2.0


def test_points_that_could_make_covariances_negative_are_refused() -> None:
    with pytest.raises(InputError, match="beta=0: must be at least"):
        SigmaPoints(beta=0.0)
    with pytest.raises(InputError, match="spread=-1: must be above 0"):
        SigmaPoints(spread=-1.0)
