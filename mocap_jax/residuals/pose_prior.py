"""Distance of a pose from what people usually do (von Marcard 2017, eq. 18)."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

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


def pose_prior_slopes(
    x: Float[Array, "*b j 3"],
    R_world_child: Float[Array, "*b j 3 3"],
    R_child_frame: Float[Array, "j 3 3"],
    axes: Float[Array, "*b 3 nv"],
    between: Bool[np.ndarray, "j nv"],
) -> Float[Array, "*b 3j nv"]:
    """Derivatives of the rotation vectors by all degrees of freedom.

    One between parent and child with world axis a changes the rotation vector x by
    Jr^-1(x) (R_world_child R_child_frame)' a.

    Args:
        x: rotation vectors of `pose_prior_rotation`.
        R_world_child: as there.
        R_child_frame: as there.
        axes: of rotation, of every degree of freedom, in the world.
        between: those that turn each joint's child in its parent.
    """
    frame = so3.matmul3(R_world_child, R_child_frame)
    turn = so3.matmul3(so3.right_jacobian_inverse(x), jnp.swapaxes(frame, -1, -2))
    own = axes[..., None, :, :] * between[:, None, :]
    rows = sum(turn[..., p, None] * own[..., p, None, :] for p in range(3))
    return rows.reshape(*x.shape[:-2], -1, axes.shape[-1])
