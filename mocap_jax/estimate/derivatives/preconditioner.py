"""The factored normal equations of a solution as JAX arrays, solved inside traced code.

The same triangular solves as `linalg.solve`, frame by frame in `lax.scan`: a callback to NumPy from
within a compiled program can wait for the very thread it blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import cho_solve
from jaxtyping import Float
from scipy.linalg import solve_triangular

from mocap_jax import linalg
from mocap_jax.estimate.derivatives.objective import Step


class Preconditioner(NamedTuple):
    """H = U'U of the poses, their border B and the factor of its Schur complement."""

    inverse: Float[Array, "t d d"]
    """U_kk^-1."""
    couplings: Float[Array, "t b d d"]
    """U_k(k+1) .. U_k(k+b)."""
    border: Float[Array, "m n"]
    """B', n = t d. Whole: XLA multiplies by one matrix a dozen times faster than by its blocks."""
    corner: Float[Array, "m m"]
    """Upper Cholesky factor of C - B'H^-1 B."""

    def solve(self, v: Step) -> Step:
        """The inverse of the normal equations times v."""
        x = self._banded(v.x)
        if not self.corner.shape[0]:
            return Step(x, v.z)
        z = cho_solve((self.corner, False), v.z - self.border @ x.ravel())
        return Step(x - self._banded((z @ self.border).reshape(x.shape)), z)

    def _banded(self, right: Array) -> Array:
        """H^-1 right, by a sweep forwards and one backwards."""
        nothing = jnp.zeros((self.couplings.shape[1], right.shape[1]), right.dtype)

        def forward(told: Array, row: tuple) -> tuple[Array, Array]:
            inverse, couplings, r = row
            y = (r - told[0]) @ inverse
            later = jnp.concatenate([told[1:], jnp.zeros_like(told[:1])])
            return later + jnp.einsum("bij,i->bj", couplings, y), y

        def backward(later: Array, row: tuple) -> tuple[Array, Array]:
            inverse, couplings, y = row
            x = inverse @ (y - jnp.einsum("bij,bj->i", couplings, later))
            return jnp.concatenate([x[None], later[:-1]]), x

        _, y = jax.lax.scan(forward, nothing, (self.inverse, self.couplings, right))
        _, x = jax.lax.scan(backward, nothing, (self.inverse, self.couplings, y), reverse=True)
        return x


def preconditioner(f: linalg.ArrowFactor, border: linalg.BorderBlocks | None) -> Preconditioner:
    """From the factor that the solver leaves behind."""
    t, d, b = f.frames, f.block, f.half_bandwidth
    blocks = f.panels.reshape(t, b + 1, d, d).swapaxes(-1, -2)
    inverse = np.stack([solve_triangular(u, np.eye(d)) for u in blocks[:, 0]])
    couplings = np.array(blocks[:, 1:])
    for j in range(1, b + 1):  # blocks past the last frame hold nothing
        couplings[t - j :, j - 1] = 0.0
    m = len(f.corner)
    beside = (
        np.concatenate([border(k) for k in range(t)], 1) if border and m else np.zeros((0, t * d))
    )
    return Preconditioner(*(jnp.asarray(x) for x in (inverse, couplings, beside, f.corner)))
