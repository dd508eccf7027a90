"""LAPACK's banded Cholesky solve of the same matrix: the yardstick of an iteration."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack
from threadpoolctl import threadpool_limits


def pack(lower: np.ndarray, damping: float) -> np.ndarray:
    """Lower blocks (t, b + 1, d, d) in LAPACK's band storage ((b + 1) d, t d), Fortran order.

    Entry [i - j, j] holds H[i, j]; `damping` is added to the diagonal.
    """
    t, width, d, _ = lower.shape
    band = np.zeros((width * d, t * d), order="F")
    for column in range(d):
        # Column j = k d + column of H, rows k d .. (k + b + 1) d, is a column of the block column.
        rows = lower[:, :, :, column].reshape(t, width * d)[:, column:]
        band[: width * d - column, column::d] = rows.T
    band[0] += damping
    for past in range(1, width):
        # Blocks past the last frame are not part of the matrix.
        for column in range(d):
            band[past * d - column :, (t - past) * d + column] = 0.0
    return band


def solve(band: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """Factor (dpbtrf, destroying `band`) and solve (dpbtrs) on one BLAS thread."""
    with threadpool_limits(limits=1, user_api="blas"):
        factor, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if info:
            raise RuntimeError(f"dpbtrf: not positive definite at {info}")
        x, info = lapack.dpbtrs(factor, rhs, lower=1, overwrite_b=1)
    return x
