"""Velocities of poses on a uniform grid."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax.body import Body, Topology, difference


@partial(jax.jit, static_argnums=0)
def _central_velocity(topology: Topology, poses: jax.Array, step: float) -> jax.Array:
    steps = jax.vmap(lambda a, b: difference(topology, a, b))(poses[:-1], poses[1:]) / step
    inner = 0.5 * (steps[:-1] + steps[1:])
    return jnp.concatenate([steps[:1], inner, steps[-1:]])


def central_velocity(body: Body, q: np.ndarray, step: float) -> np.ndarray:
    """Velocities (t, nv) of poses on a uniform grid, by central differences."""
    return np.asarray(_central_velocity(body.topology, jnp.asarray(q), step))
