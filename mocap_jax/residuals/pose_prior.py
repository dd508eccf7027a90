"""Distance of a pose from what people usually do (von Marcard 2017, eq. 18)."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3


def pose_prior_rotation(
    R_world_child: Float[Array, "*b j 3 3"],
    R_world_parent: Float[Array, "*b j 3 3"],
    R_child_frame: Float[Array, "j 3 3"],
    R_parent_mean: Float[Array, "j 3 3"],
) -> Float[Array, "*b j 3"]:
    """Rotation vectors [rad] of joints from their mean rotations, before whitening.

    Args:
        R_world_child: of the joints' child segments.
        R_world_parent: of their parent segments.
        R_child_frame: the child's anatomical frame.
        R_parent_mean: where that frame is in the parent at the mean rotation.
    """
    mean = so3.matmul3(R_world_parent, R_parent_mean)
    now = so3.matmul3(R_world_child, R_child_frame)
    return so3.log(so3.matmul3(jnp.swapaxes(mean, -1, -2), now))
