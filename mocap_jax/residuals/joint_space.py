"""Residuals on the pose itself: reference poses, joint limits, process smoothness.

All are separable by joint, so their Jacobians are diagonal, or 3x3 blocks for rotations.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Topology, difference


def limit_violation(
    value: Float[Array, "*b"], lower: Float[Array, "*b"], upper: Float[Array, "*b"], softness: float
) -> Float[Array, "*b"]:
    """Smooth amount by which a coordinate lies outside its range (twice differentiable).

    softplus(x / s) s of the violation on either side: about zero inside, slope one outside.

    Args:
        value: coordinate [rad or m].
        lower: lower limit, -inf where unlimited.
        upper: upper limit, inf where unlimited.
        softness: s, width of the transition [rad or m].
    """
    finite_lower = jnp.where(jnp.isfinite(lower), lower, 0.0)
    finite_upper = jnp.where(jnp.isfinite(upper), upper, 0.0)
    below = softness * jax.nn.softplus((finite_lower - value) / softness)
    above = softness * jax.nn.softplus((value - finite_upper) / softness)
    return jnp.where(jnp.isfinite(upper), above, 0.0) - jnp.where(jnp.isfinite(lower), below, 0.0)


def reference_residual(
    topology: Topology, q: Float[Array, "nq"], q_reference: Float[Array, "nq"]
) -> Float[Array, "nv"]:
    """Tangent vector from a reference pose to the pose."""
    return difference(topology, q_reference, q)


def smoothness_coefficients(order: int, step: Array) -> Array:
    """Weights of successive increments q_k -> q_k+1 whose sum is the second (third) difference."""
    if order == 2:
        return jnp.array([-1.0, 1.0]) / step**2
    return jnp.array([1.0, -2.0, 1.0]) / step**3


def smoothness_residual(
    topology: Topology, q: Float[Array, "w nq"], coefficients: Float[Array, "w-1"]
) -> Float[Array, "nv"]:
    """Finite-difference acceleration (or jerk) of a window of poses, in the tangent space."""
    steps = jnp.stack([difference(topology, q[i], q[i + 1]) for i in range(q.shape[0] - 1)])
    return coefficients @ steps


def increment_jacobians(
    increment: Float[Array, "*b 3"],
) -> tuple[Float[Array, "*b 3 3"], Float[Array, "*b 3 3"]]:
    """Derivatives of log(R_0' R_1) by right perturbations of R_1 and of R_0."""
    inverse = so3.right_jacobian_inverse(increment)
    return inverse, -jnp.swapaxes(inverse, -1, -2)
