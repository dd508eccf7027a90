"""Block-banded Cholesky as `lax.scan`: what `jit`, `vmap` and `grad` see.

The same equations as `arrow` without a border, one frame a step, linear in the number of frames.
On CPU it is a few times slower than the host solver; it needs nothing outside JAX.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float


class ScanFactor(NamedTuple):
    """Cholesky factor H = LL' by frames."""

    diagonal: Float[Array, "t d d"]
    """L_kk, lower triangular."""
    below: Float[Array, "t b*d d"]
    """L_(k+1)k, ..., L_(k+b)k, stacked in rows."""


def scan_factor(lower: Float[Array, "t b+1 d d"]) -> ScanFactor:
    """Factor a block-banded positive definite matrix.

    Args:
        lower: `lower[k, o]` is block (k + o, k); blocks past the last frame must be zero.

    Returns:
        The factor; NaN where the matrix is not positive definite.
    """
    t, width, d, _ = lower.shape
    bd = (width - 1) * d

    def step(pending: Array, blocks: Array) -> tuple[Array, tuple[Array, Array]]:
        # `pending`: what earlier frames subtract from frames k .. k + b - 1.
        column = blocks.reshape(width * d, d).at[:bd].add(-pending[:, :d])
        diagonal = jnp.linalg.cholesky(column[:d])
        below = solve_triangular(diagonal, column[d:].T, lower=True).T
        shifted = jnp.zeros_like(pending).at[: bd - d, : bd - d].set(pending[d:, d:])
        return shifted + below @ below.T, (diagonal, below)

    _, (diagonal, below) = jax.lax.scan(step, jnp.zeros((bd, bd), lower.dtype), lower)
    return ScanFactor(diagonal, below)


def scan_solve(f: ScanFactor, rhs: Float[Array, "t d"]) -> Float[Array, "t d"]:
    """Solve H x = rhs."""
    d = rhs.shape[1]
    bd = f.below.shape[1]

    def forward(pending: Array, row: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        diagonal, below, r = row
        y = solve_triangular(diagonal, r - pending[:d], lower=True)
        shifted = jnp.concatenate([pending[d:], jnp.zeros(d, rhs.dtype)])
        return shifted + below @ y, y

    def backward(later: Array, row: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        diagonal, below, y = row
        x = solve_triangular(diagonal, y - below.T @ later, lower=True, trans=1)
        return jnp.concatenate([x, later[:-d]]), x

    zero = jnp.zeros(bd, rhs.dtype)
    _, y = jax.lax.scan(forward, zero, (f.diagonal, f.below, rhs))
    _, x = jax.lax.scan(backward, zero, (f.diagonal, f.below, y), reverse=True)
    return x
