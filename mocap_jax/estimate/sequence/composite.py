"""From information about sensors' twists to normal equations in joint coordinates.

As in the composite-rigid-body algorithm: degrees of freedom i and j share the sensors that both
move, which for a tree are all sensors beyond the one farther out. So the information of sensors is
summed beyond every degree of freedom once (a 6x6 composite), and block (i, j) is one 6-vector
product: S_i' A_j S_j if i moves whatever j moves, S_i' A_i S_j the other way round, else zero.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Topology


def nesting(topology: Topology) -> tuple[np.ndarray, np.ndarray]:
    """Masks (nv, nv): row i moves all that column j moves; the other way round only."""
    dof_body = np.array(topology.joint_body)[topology.dof_joint]
    outer = topology.body_dofs[dof_body].T
    return outer, outer.T & ~outer


def joint_block(
    topology: Topology,
    sensor_dofs: np.ndarray,
    information: Float[Array, "c s 6 6"],
    screws_later: Float[Array, "c 6 nv"],
    screws: Float[Array, "c 6 nv"],
) -> Float[Array, "c nv nv"]:
    """Block of the normal equations: rows frame k + o, columns frame k."""
    mask = jnp.asarray(sensor_dofs, information.dtype)
    composite = jnp.einsum("cspq,sd->cpqd", information, mask)
    right = (composite * screws[:, None]).sum(axis=2)
    left = (composite * screws_later[:, :, None]).sum(axis=1)
    outer, inner = nesting(topology)
    first = _product(screws_later, right)
    second = _product(left, screws)
    return jnp.where(outer, first, jnp.where(inner, second, 0.0))


def _product(a: Float[Array, "c 6 n"], b: Float[Array, "c 6 m"]) -> Float[Array, "c n m"]:
    """a' b as six rank-one terms, which XLA fuses into one vectorised loop."""
    return sum(a[:, p, :, None] * b[:, p, None, :] for p in range(6))


def joint_gradient(
    sensor_dofs: np.ndarray, wrench: Float[Array, "c s 6"], screws: Float[Array, "c 6 nv"]
) -> Float[Array, "c nv"]:
    """Gradient in joint coordinates of wrenches on sensors."""
    mask = jnp.asarray(sensor_dofs, wrench.dtype)
    return (jnp.einsum("csp,sd->cpd", wrench, mask) * screws).sum(axis=1)


def joint_border(
    sensor_dofs: np.ndarray, border: Float[Array, "c s 6 n"], screws: Float[Array, "c 6 nv"]
) -> Float[Array, "c s n nv"]:
    """Blocks of B': rows the constants of all sensors, columns degrees of freedom."""
    mask = jnp.asarray(sensor_dofs, border.dtype)[None, :, None, :]
    product = sum(border[:, :, p, :, None] * screws[:, None, p, None, :] for p in range(6))
    return product * mask
