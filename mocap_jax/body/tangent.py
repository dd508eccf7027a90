"""Tangent-space calculus on poses, as in MuJoCo (`nq` coordinates against `nv` directions).

Tangent vectors: free joint, world-frame translation then body-frame rotation; ball joint,
rotation in the child frame; hinge and slide, the coordinate itself.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body.topology import Topology


@partial(jax.jit, static_argnums=0, inline=True)
def retract(
    topology: Topology, q: Float[Array, "nq"], delta: Float[Array, "nv"]
) -> Float[Array, "nq"]:
    """Move the pose q along a tangent vector (`mj_integratePos` with unit time)."""
    scalar_q, scalar_v = topology.scalar_index
    quat_q, quat_v = topology.quat_index
    q = q.at[scalar_q].add(delta[scalar_v])
    if quat_q.size:
        q = q.at[quat_q].set(so3.quat_multiply(q[quat_q], so3.quat_exp(delta[quat_v])))
    return q


@partial(jax.jit, static_argnums=0, inline=True)
def difference(
    topology: Topology, q_from: Float[Array, "nq"], q_to: Float[Array, "nq"]
) -> Float[Array, "nv"]:
    """Tangent vector at `q_from` that leads to `q_to`; inverse of `retract`."""
    scalar_q, scalar_v = topology.scalar_index
    quat_q, quat_v = topology.quat_index
    delta = jnp.zeros(topology.nv, q_from.dtype)
    delta = delta.at[scalar_v].set(q_to[scalar_q] - q_from[scalar_q])
    if quat_q.size:
        relative = so3.quat_multiply(so3.quat_conjugate(q_from[quat_q]), q_to[quat_q])
        delta = delta.at[quat_v].set(so3.quat_log(relative))
    return delta


def transport(
    topology: Topology, delta: Float[Array, "nv"], vectors: Float[Array, "nv *k"]
) -> Float[Array, "nv *k"]:
    """Carry pose errors at q to the tangent space at `retract(q, delta)`.

    To first order `difference(retract(q, delta), retract(q, delta + e)) == transport(delta, e)`.
    Rotational blocks are multiplied by the right Jacobian of SO(3), the rest is unchanged.
    """
    _, quat_v = topology.quat_index
    if not quat_v.size:
        return vectors
    jacobian = so3.right_jacobian(delta[quat_v])
    blocks = vectors[quat_v]
    moved = jnp.einsum("nij,nj...->ni...", jacobian, blocks)
    return vectors.at[quat_v].set(moved, unique_indices=True)


def velocity_to_tangent(
    topology: Topology, q: Float[Array, "nq"], dq: Float[Array, "nq"]
) -> Float[Array, "nv"]:
    """Tangent vector of a small change dq of the coordinates (linear in dq)."""
    scalar_q, scalar_v = topology.scalar_index
    quat_q, quat_v = topology.quat_index
    v = jnp.zeros(topology.nv, q.dtype).at[scalar_v].set(dq[scalar_q], unique_indices=True)
    if quat_q.size:
        quat = q[quat_q]
        local = so3.quat_multiply(so3.quat_conjugate(quat), dq[quat_q])[..., 1:]
        turn = 2.0 * local / (quat * quat).sum(-1, keepdims=True)
        v = v.at[quat_v].set(turn, unique_indices=True)
    return v


def normalise(topology: Topology, q: Float[Array, "nq"]) -> Float[Array, "nq"]:
    """Bring all quaternions of a pose to unit norm."""
    quat_q, _ = topology.quat_index
    return q.at[quat_q].set(so3.quat_normalise(q[quat_q])) if quat_q.size else q
