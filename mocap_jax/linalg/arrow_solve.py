"""Solutions of arrow equations from their factor (`arrow`), their covariances and samples."""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from mocap_jax.linalg.arrow import BLAS, ArrowFactor, BorderBlocks, BorderProducts


def forward(f: ArrowFactor, rhs: np.ndarray) -> np.ndarray:
    """Solve U'y = rhs for H = U'U; rhs of shape (t, d) or (t, d, n)."""
    t, d, b = f.frames, f.block, f.half_bandwidth
    y = np.array(rhs, float)
    with BLAS.limit(limits=1, user_api="blas"):
        for k in range(t):
            for j in range(1, min(b, k) + 1):
                y[k] -= f.panels[k - j, j * d : (j + 1) * d] @ y[k - j]
            y[k] = _triangular(f.panels[k, :d], y[k], transposed=True)
    return y


def backward(f: ArrowFactor, rhs: np.ndarray) -> np.ndarray:
    """Solve U x = rhs for H = U'U; rhs of shape (t, d) or (t, d, n)."""
    t, d, b = f.frames, f.block, f.half_bandwidth
    x = np.array(rhs, float)
    with BLAS.limit(limits=1, user_api="blas"):
        for k in range(t - 1, -1, -1):
            reach = min(b, t - 1 - k)
            if reach:
                later = x[k + 1 : k + 1 + reach].reshape((reach * d, *x.shape[2:]))
                x[k] -= f.panels[k, d : (reach + 1) * d].T @ later
            x[k] = _triangular(f.panels[k, :d], x[k], transposed=False)
    return x


def _triangular(panel: np.ndarray, rhs: np.ndarray, *, transposed: bool) -> np.ndarray:
    """Solve with U (or U') where `panel` holds U' in C order."""
    if rhs.ndim == 1:
        return blas.dtrsv(panel.T, rhs, lower=0, trans=int(transposed))
    return blas.dtrsm(1.0, panel.T, rhs, side=0, lower=0, trans_a=int(transposed))


def solve_banded(f: ArrowFactor, rhs: np.ndarray) -> np.ndarray:
    """Solve H x = rhs (without the border); rhs of shape (t, d) or (t, d, n)."""
    return backward(f, forward(f, rhs))


def solve(
    f: ArrowFactor, rhs: np.ndarray, rhs_corner: np.ndarray, border: BorderBlocks | None
) -> tuple[np.ndarray, np.ndarray]:
    """Solve the whole arrow system for one right-hand side.

    Args:
        f: its factor.
        rhs: (t, d).
        rhs_corner: (m,).
        border: the same blocks of B' that were factored.

    Returns:
        (x, z) of shapes (t, d) and (m,).
    """
    x = solve_banded(f, rhs)
    if border is None or not len(rhs_corner):
        return x, np.zeros(0)
    z = solve_corner(f, rhs_corner - _pulled(border, x))
    return x - solve_banded(f, _times(border, z, f.frames)), z


def _times(border: BorderBlocks, z: np.ndarray, frames: int) -> np.ndarray:
    """B z, (t, d)."""
    if isinstance(border, BorderProducts):
        return border.times(z)
    return np.stack([border(k).T @ z for k in range(frames)])


def _pulled(border: BorderBlocks, x: np.ndarray) -> np.ndarray:
    """B'x, (m,)."""
    if isinstance(border, BorderProducts):
        return border.pulled(x)
    return sum(border(k) @ row for k, row in enumerate(x))


def solve_corner(f: ArrowFactor, rhs: np.ndarray) -> np.ndarray:
    """Solve S z = rhs with the Schur complement S."""
    return lapack.dpotrs(f.corner, rhs, lower=0)[0]


def corner_covariance(f: ArrowFactor) -> np.ndarray:
    """Covariance of the constant unknowns: the inverse of the Schur complement, (m, m)."""
    m = len(f.corner)
    return solve_corner(f, np.eye(m)) if m else np.zeros((0, 0))


def sample(
    f: ArrowFactor, border: BorderBlocks | None, generator: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Draw (x, z) from the normal distribution whose information matrix was factored."""
    m = len(f.corner)
    x = backward(f, generator.normal(size=(f.frames, f.block)))
    if border is None or not m:
        return x, np.zeros(0)
    z = blas.dtrsv(f.corner, generator.normal(size=m), lower=0)
    return x - solve_banded(f, _times(border, z, f.frames)), z
