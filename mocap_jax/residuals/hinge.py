"""Rotation of a joint about other axes than its hinge's."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3


def hinge_residual(
    quaternion: Float[Array, "*b 4"],
    reference: Float[Array, "*b 4"],
    axis: Float[Array, "*b 3"],
) -> Float[Array, "*b 3"]:
    """Part of a joint's rotation vector [rad] that is not along its hinge's axis.

    Args:
        quaternion: of the joint (wxyz).
        reference: of the joint in a pose where it is turned about its axis alone.
        axis: unit vector in the child's frame.
    """
    start, now = so3.quat_to_matrix(reference), so3.quat_to_matrix(quaternion)
    turned = so3.log(so3.matmul3(jnp.swapaxes(start, -1, -2), now))
    return turned - axis * (turned * axis).sum(axis=-1, keepdims=True)
