"""Random problems shared by the tests of the linear algebra."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

Arrow = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@pytest.fixture
def random_arrow() -> Callable[..., Arrow]:
    """Maker of random positive definite arrow matrices: dense, lower, corner, border."""
    return make_random_arrow


def make_random_arrow(t: int, d: int, b: int, m: int, seed: int = 0) -> Arrow:
    """A random positive definite arrow matrix, dense and in blocks."""
    rng = np.random.default_rng(seed)
    jacobian = np.zeros((4 * t * d, t * d + m))
    rows = jacobian.shape[0] // t
    for k in range(t):
        last = min(t, k + b + 1)
        jacobian[k * rows : (k + 1) * rows, k * d : last * d] = rng.normal(
            size=(rows, (last - k) * d)
        )
    jacobian[:, t * d :] = rng.normal(size=(jacobian.shape[0], m))
    dense = jacobian.T @ jacobian
    lower = np.zeros((t, b + 1, d, d))
    for k in range(t):
        for o in range(min(b + 1, t - k)):
            lower[k, o] = dense[(k + o) * d : (k + o + 1) * d, k * d : (k + 1) * d]
    border = np.ascontiguousarray(dense[t * d :, : t * d].reshape(m, t, d).transpose(1, 0, 2))
    return dense, lower, dense[t * d :, t * d :], border
