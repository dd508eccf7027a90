"""Refinement reaches the accuracy of a QR factorisation of J."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax import linalg
from mocap_jax.errors import SolveError
from mocap_jax.linalg.refine import refine, shifted_factor

T = 600


class Drift:
    """Positions of one axis seen through second differences only, tied down at the start.

    Two unknowns a frame: position and a well determined companion. Border: the constant error of
    all second differences.
    """

    def __init__(self, step: float) -> None:
        rng = np.random.default_rng(1)
        n = 2 * T + 1
        rows = []
        for k in range(1, T - 1):
            row = np.zeros(n)
            row[[2 * k - 2, 2 * k, 2 * k + 2]] = np.array([1, -2, 1]) / step**2
            row[-1] = 1
            rows.append(row)
        for k in range(T):
            row = np.zeros(n)
            row[2 * k + 1] = 3.0
            rows.append(row)
        for k in range(2):
            row = np.zeros(n)
            row[2 * k] = 10.0
            rows.append(row)
        row = np.zeros(n)
        row[-1] = 1.0
        self.J = np.array([*rows, row])
        self.r = rng.normal(size=len(self.J))
        H = self.J.T @ self.J
        blocks = H[:-1, :-1].reshape(T, 2, T, 2)
        self.lower = np.zeros((T, 3, 2, 2))
        for k in range(T):
            for o in range(min(3, T - k)):
                self.lower[k, o] = blocks[k + o, :, k]
        self.corner, self._border = H[-1:, -1:], H[-1:, :-1].reshape(T, 1, 2)

    def border(self, k: int) -> np.ndarray:
        return self._border[k]

    def model(self, x: np.ndarray, z: np.ndarray, *, offset: bool) -> tuple:
        g = self.J.T @ (offset * self.r + self.J @ np.concatenate([x.ravel(), z]))
        return g[:-1].reshape(T, 2), g[-1:]

    def step(self) -> np.ndarray:
        Q, R = np.linalg.qr(self.J)
        return np.linalg.solve(R, -Q.T @ self.r)


@pytest.mark.parametrize("step", [0.02, 0.002])
def test_refined_step_is_that_of_qr(step: float) -> None:
    drift = Drift(step)
    expected = drift.step()
    f, _ = shifted_factor(drift.lower, drift.corner, drift.border)
    x, z = np.zeros((T, 2)), np.zeros(1)
    done = refine(f, drift.border, drift.model, x, z, tolerance=1e-10)
    assert done.converged and len(done.steps) < 20
    got = np.concatenate([done.x.ravel(), done.z])
    assert np.abs(got - expected).max() < 1e-6 * np.abs(expected).max()


def test_shift_is_used_only_where_needed() -> None:
    eye = np.tile(np.eye(2), (4, 1, 1, 1))
    assert shifted_factor(eye)[1] == 0.0
    rounded = eye.copy()
    rounded[2, 0, 1, 1] = -1e-17
    f, shift = shifted_factor(rounded)
    assert 0 < shift < 1e-14
    with pytest.raises(SolveError, match="singular"):
        shifted_factor(-eye)


def test_a_shift_far_above_the_slow_modes_is_undone() -> None:
    drift = Drift(0.02)
    f = linalg.factor(drift.lower, drift.corner, drift.border, damping=1.0)
    done = refine(
        f, drift.border, drift.model, np.zeros((T, 2)), np.zeros(1),
        tolerance=1e-10, max_iterations=60,
    )  # fmt: skip
    expected = drift.step()
    got = np.concatenate([done.x.ravel(), done.z])
    assert done.converged
    assert np.abs(got - expected).max() < 1e-6 * np.abs(expected).max()
