"""The manifold of a body's poses, as the filter needs it."""

from __future__ import annotations

from collections.abc import Callable

import jax.numpy as jnp
from jax import Array

from mocap_jax import so3
from mocap_jax.body import Topology, difference, retract
from mocap_jax.kalman import Manifold


def pose_manifold(topology: Topology) -> Manifold:
    """Retraction and Jacobians of ball and free rotations; all other coordinates simply add."""
    blocks = topology.quat_index[1]

    def on_blocks(of: Callable[[Array], Array]) -> Callable[[Array, Array], Array]:
        def apply(delta: Array, X: Array) -> Array:
            if not blocks.size:
                return X
            M = of(delta[blocks])
            moved = (M[..., None] * X[blocks][:, None]).sum(2)
            return X.at[blocks].set(moved)

        return apply

    return Manifold(
        retract=lambda q, delta: retract(topology, q, delta),
        difference=lambda q_from, q_to: difference(topology, q_from, q_to),
        shift=on_blocks(lambda w: jnp.swapaxes(so3.exp(w), -1, -2)),
        jacobian=on_blocks(so3.right_jacobian),
        jacobian_inverse=on_blocks(so3.right_jacobian_inverse),
    )
