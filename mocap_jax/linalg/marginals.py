"""Marginal covariances of every frame from the factor of an arrow matrix."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import blas, lapack

from mocap_jax.linalg.arrow import BLAS, ArrowFactor, BorderBlocks, eliminate_border


def marginals(f: ArrowFactor, border: BorderBlocks | None = None) -> np.ndarray:
    """Marginal covariance of every frame by selected inversion.

    Takahashi's recursion in square-root form: the covariance of b successive frames is carried as
    R'R and extended backwards by one frame with a QR factorisation. The plain recursion overflows
    when well and badly determined unknowns meet.

    Args:
        f: the factor of the information matrix.
        border: the same blocks of B' that were factored, if any.

    Returns:
        (t, d, d), the diagonal blocks of the inverse of the whole arrow matrix.
    """
    t, d, b = f.frames, f.block, f.half_bandwidth
    out = np.empty((t, d, d))
    root = np.zeros((0, 0))
    eye = np.eye(d, order="F")
    with BLAS.limit(limits=1, user_api="blas"):
        for k in range(t - 1, -1, -1):
            reach = len(root) // d
            inverse = blas.dtrsm(1.0, f.panels[k, :d].T, eye, side=0, lower=0)
            # Rows: independent unit deviations; columns: frame k, then the frames after it.
            spread = np.zeros(((reach + 1) * d, min(reach + 1, b) * d), order="F")
            spread[:d, :d] = inverse.T
            if reach:
                gain = blas.dtrmm(1.0, inverse, f.panels[k, d : (reach + 1) * d].T, lower=0)
                spread[d:, :d] = -root @ gain.T
                spread[d:, d:] = root[:, : spread.shape[1] - d]
            triangle, _, _, _ = lapack.dgeqrf(spread, overwrite_a=1)
            root = np.triu(triangle[: spread.shape[1]])
            out[k] = root[:d, :d].T @ root[:d, :d]
    if border is not None:
        _add_border_covariance(f, border, out)
    return out


def _add_border_covariance(f: ArrowFactor, border: BorderBlocks, out: np.ndarray) -> None:
    """Add X S^-1 X' with X = H^-1 B: what not knowing the constants adds to each frame."""
    d, b = f.block, f.half_bandwidth
    following: list[np.ndarray] = []
    with BLAS.limit(limits=1, user_api="blas"):
        for k, x in _eliminated_backwards(f, border):
            for j, later in enumerate(following[:b], start=1):
                coupling = f.panels[k].T[:, j * d : (j + 1) * d]
                blas.dgemm(-1.0, coupling, later, 1.0, x, overwrite_c=1)
            blas.dtrsm(1.0, f.panels[k].T[:, :d], x, side=0, lower=0, overwrite_b=1)
            whitened = blas.dtrsm(1.0, f.corner, x, side=1, lower=0)
            out[k] += whitened @ whitened.T
            following = [x, *following[: b - 1]]


def _eliminated_backwards(f: ArrowFactor, border: BorderBlocks) -> Iterator[tuple[int, np.ndarray]]:
    """The blocks of U'^-1 B from the last frame to the first, recomputed stretch by stretch."""
    for i in range(len(f.kept) - 1, -1, -1):
        first, recent, blocks = i * f.stretch, f.kept[i], []
        for k in range(first, min(first + f.stretch, f.frames)):
            blocks.append(
                eliminate_border(f.panels, k, f.half_bandwidth, f.block, border(k), recent)
            )
            recent = [blocks[-1], *recent[: f.half_bandwidth - 1]]
        while blocks:
            yield first + len(blocks) - 1, blocks.pop()
