"""The plain covariance update in single precision against Joseph's form in double."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax.kalman.update import correct

FRAMES, ROWS, STEP = 200, 6, 0.01
N = 9


def _motion() -> tuple[np.ndarray, np.ndarray]:
    """Three coordinates, their rates and accelerations, driven by jerk."""
    eye, o = np.eye(3), np.zeros((3, 3))
    F = np.block([[eye, STEP * eye, STEP**2 / 2 * eye], [o, eye, STEP * eye], [o, o, eye]])
    G = np.concatenate([STEP**3 / 6 * eye, STEP**2 / 2 * eye, STEP * eye])
    return F, 1e3 / STEP * G @ G.T


def _joseph(P: np.ndarray, H: np.ndarray, R: np.ndarray) -> np.ndarray:
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    A = np.eye(N) - K @ H
    return A @ P @ A.T + K @ R @ K.T


def _chain() -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Covariances after each update: ours in single precision, Joseph's in double."""
    rng = np.random.default_rng(0)
    F, Q = _motion()
    H = rng.normal(size=(FRAMES, ROWS, N))
    H[:, :, 3:] *= 0.3
    R = rng.uniform(1e-4, 1e-2, (FRAMES, ROWS))
    exact = np.diag(np.repeat([1e-2, 1e-1, 1e1], 3))
    single = lambda x: jnp.asarray(x, jnp.float32)  # noqa: E731
    ours, F_single, Q_single = single(exact), single(F), single(Q)

    @jax.jit
    def step(P: jax.Array, H: jax.Array, R: jax.Array) -> jax.Array:
        P = F_single @ P @ F_single.T + Q_single
        return correct(P, H, jnp.zeros(ROWS, P.dtype), R, jnp.ones(ROWS, bool))[1]

    found, expected = [], []
    for k in range(FRAMES):
        ours = step(ours, single(H[k]), single(R[k]))
        exact = _joseph(F @ exact @ F.T + Q, H[k], np.diag(R[k]))
        assert ours.dtype == jnp.float32
        found.append(np.asarray(ours, float))
        expected.append(exact)
    return found, expected


def test_single_precision_follows_josephs_form() -> None:
    """Entries over the deviations of both coordinates: rounding neither grows nor turns negative.

    The condition number of the whitened covariance, about 1e3, times the precision is 1e-4.
    """
    for ours, exact in zip(*_chain(), strict=True):
        deviation = np.sqrt(np.diag(exact))
        scale = np.outer(deviation, deviation)
        np.testing.assert_allclose(ours / scale, exact / scale, atol=5e-3)
        np.testing.assert_allclose(ours / scale, ours.T / scale, atol=1e-3)
        least = np.linalg.eigvalsh(exact / scale).min()
        assert np.linalg.eigvalsh((ours + ours.T) / (2 * scale)).min() > 0.5 * least
