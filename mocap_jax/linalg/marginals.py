"""Marginal covariances of every frame, and of neighbours, from the factor of an arrow matrix."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import blas, lapack

from mocap_jax.linalg.arrow import BLAS, ArrowFactor, BorderBlocks, eliminate_border

# Columns that LAPACK's triangular QR takes at a time: small blocks, so few of them.
_COLUMNS = 8


def marginals(f: ArrowFactor, border: BorderBlocks | None = None) -> np.ndarray:
    """Marginal covariance of every frame by selected inversion.

    Takahashi's recursion in square-root form: the covariance of b successive frames is carried as
    R'R and extended backwards by one frame with orthogonal transformations. The plain recursion
    overflows when well and badly determined unknowns meet.

    Args:
        f: the factor of the information matrix.
        border: the same blocks of B' that were factored, if any.

    Returns:
        (t, d, d), the diagonal blocks of the inverse of the whole arrow matrix.
    """
    return _selected(f, border, None)


def pair_marginals(
    f: ArrowFactor, border: BorderBlocks | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Marginal covariances of every frame and of every pair of neighbours.

    Args:
        f: the factor of the information matrix.
        border: the same blocks of B' that were factored, if any.

    Returns:
        The diagonal blocks (t, d, d), and the blocks below them (t - 1, d, d): entry k is the
        covariance of frame k + 1 (rows) with frame k (columns).
    """
    pairs = np.empty((max(f.frames - 1, 0), f.block, f.block))
    return _selected(f, border, pairs), pairs


def _selected(f: ArrowFactor, border: BorderBlocks | None, pairs: np.ndarray | None) -> np.ndarray:
    """The diagonal blocks of the inverse; those below them are put into `pairs`, if given."""
    d, b = f.block, f.half_bandwidth
    out = np.empty((f.frames, d, d))
    # Upper triangle: a root of the covariance of the frames just after k, the latest first.
    root = np.zeros((0, 0), order="F")
    with BLAS.limit(limits=1, user_api="blas"):
        for k in range(f.frames - 1, -1, -1):
            inverse, _ = lapack.dtrtri(f.panels[k].T[:, :d], lower=0)
            follow = _following(f.panels[k], inverse, root)
            if pairs is not None and len(root):
                pairs[k] = blas.dgemm(1.0, root[:, -d:], follow, trans_a=1)
            root = _extended(root, follow, inverse, b)
            column = root[:, -d:]
            out[k] = blas.dgemm(1.0, column, column, trans_a=1)
    if border is not None:
        _add_border_covariance(f, border, out, pairs)
    return out


def _following(panel: np.ndarray, inverse: np.ndarray, root: np.ndarray) -> np.ndarray:
    """How a frame follows the deviations of those after it: -R G' for x_k = -G x_after + noise."""
    d, reach = len(inverse), len(root) // len(inverse)
    later = np.empty((d, reach * d), order="F")
    for j in range(reach):
        later[:, j * d : (j + 1) * d] = panel[(reach - j) * d : (reach - j + 1) * d].T
    if not reach:
        return np.zeros((0, d), order="F")
    gain = blas.dtrmm(1.0, inverse, later, lower=0, overwrite_b=1)
    return blas.dtrmm(-1.0, root, np.asfortranarray(gain.T), lower=0, overwrite_b=1)


def _extended(root: np.ndarray, follow: np.ndarray, inverse: np.ndarray, b: int) -> np.ndarray:
    """Take frame k into the window, and its latest frame out of it where it holds b already.

    With the new columns the root is [[R, -R G'], [0, U^-T]]. Without its first d columns it has
    d rows too many in front; they are turned into the rest, one block of columns after another.
    """
    d = len(inverse)
    window = np.concatenate([root, follow], axis=1)
    full = len(root) == b * d
    n = len(root) + (0 if full else d)
    out = np.zeros((n, n), order="F")
    if not full:
        out[:-d] = window
        out[-d:, -d:] = _triangle(inverse.T)
        return out
    spare = np.asfortranarray(window[:d, d:])
    for i in range(1, b):
        here, rows, put = slice(i * d, (i + 1) * d), window[i * d : (i + 1) * d], (i - 1) * d
        triangle, v, t, _ = lapack.dtpqrt(0, min(_COLUMNS, d), rows[:, here], spare[:, :d])
        rest, spare, _ = lapack.dtpmqrt(
            0, v, t, rows[:, here.stop :], spare[:, d:], side="L", trans="T"
        )
        out[put : put + d, put : put + d] = triangle
        out[put : put + d, put + d :] = rest
    out[-d:, -d:] = _triangle(np.concatenate([inverse.T, spare]))
    return out


def _triangle(rows: np.ndarray) -> np.ndarray:
    """The triangular factor of a QR factorisation."""
    factored, _, _, _ = lapack.dgeqrf(rows)
    return np.triu(factored[: rows.shape[1]])


def _add_border_covariance(
    f: ArrowFactor, border: BorderBlocks, out: np.ndarray, pairs: np.ndarray | None
) -> None:
    """Add X S^-1 X' with X = H^-1 B: what not knowing the constants adds."""
    d, b = f.block, f.half_bandwidth
    following: list[np.ndarray] = []
    after = np.zeros((0, 0))
    # Multiplying by inverted triangles is twice as fast as solving with them.
    whiten, _ = lapack.dtrtri(f.corner, lower=0)
    with BLAS.limit(limits=1, user_api="blas"):
        for k, x in _eliminated_backwards(f, border):
            for j, later in enumerate(following[:b], start=1):
                coupling = f.panels[k].T[:, j * d : (j + 1) * d]
                blas.dgemm(-1.0, coupling, later, 1.0, x, overwrite_c=1)
            inverse, _ = lapack.dtrtri(f.panels[k].T[:, :d], lower=0)
            x = blas.dtrmm(1.0, inverse, x, side=0, lower=0, overwrite_b=1)
            whitened = blas.dtrmm(1.0, whiten, x, side=1, lower=0)
            out[k] += whitened @ whitened.T
            if pairs is not None and len(after):
                pairs[k] += after @ whitened.T
            after = whitened
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
