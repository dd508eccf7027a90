"""How quantities that people read (orientations, positions, angles) move with the pose.

All are derivatives by the tangent vector delta of `retract(q, delta)` at 0, exact, from the world
screws of the degrees of freedom. What lies relative to the root segment does not move with the
degrees of freedom that carry the root: these columns are exactly zero, not a small difference.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, frames
from mocap_jax.body.kinematics import Frames
from mocap_jax.solution.poses import root_segment

# The cosine of the middle Cardan angle is not taken for smaller than this: the derivatives at
# gimbal lock are huge, not infinite.
_LEAST_COSINE = 1e-9


class PoseJacobians(NamedTuple):
    """Derivatives of every segment's frame at one pose. The world (body 0) is no segment: its rows
    relative to the root are zero and mean nothing."""

    orientation: Float[Array, "nbody 3 nv"]
    """World rotation vector e of `Exp(e) R_world_segment`."""
    position: Float[Array, "nbody 3 nv"]
    """World position of the segment's origin."""
    orientation_in_root: Float[Array, "nbody 3 nv"]
    """Rotation vector e, in the root segment's frame, of `Exp(e) R_root_segment`."""
    position_in_root: Float[Array, "nbody 3 nv"]
    """Position of the segment's origin, in coordinates of the root segment's frame."""


def pose_jacobians(body: Body, q: Float[Array, "nq"]) -> PoseJacobians:
    """Derivatives of all segments' frames at a pose."""
    topology, f = body.topology, frames(body, q)
    root = root_segment(topology)
    moves = np.asarray(topology.body_dofs, bool)
    between = moves & ~moves[root]
    travel = f.linear + so3.cross(f.angular[None], f.position[:, None])
    masked = lambda mask, x: jnp.where(mask[..., None], x, 0.0)  # noqa: E731
    R_world_root = f.rotation[root]
    return PoseJacobians(
        *(
            jnp.swapaxes(x, 1, 2)
            for x in (
                masked(moves, f.angular), masked(moves, travel),
                masked(between, f.angular) @ R_world_root, masked(between, travel) @ R_world_root,
            )
        )
    )  # fmt: skip


def cardan_jacobians(
    body: Body,
    q: Float[Array, "nq"],
    anatomical: Float[Array, "nbody 3 3"],
    pairs: tuple[tuple[int, int], ...],
) -> Float[Array, "n 3 nv"]:
    """Derivatives of the Z-X-Y angles of segments relative to others, at one pose.

    Args:
        body: the body.
        q: pose.
        anatomical: `R_segment_anatomical` of every segment.
        pairs: (segment, base) by body index.

    Returns:
        Rows z, x, y of each pair, for the solution with x between -pi/2 and pi/2 (the derivative
        of x has the other sign for the other solution). They grow without bound near gimbal lock.
    """
    f = frames(body, q)
    segment, base = np.array(pairs, int).reshape(-1, 2).T
    R_world = so3.matmul3(f.rotation, anatomical)
    R_base_segment = so3.matmul3(jnp.swapaxes(R_world[base], 1, 2), R_world[segment])
    turn = _relative_screws(body, f, segment, base) @ R_world[base]
    return _angle_rates(R_base_segment, jnp.moveaxis(turn, -1, 0))


def relative_rotation_jacobians(
    body: Body, q: Float[Array, "nq"], pairs: tuple[tuple[int, int], ...]
) -> Float[Array, "n 3 nv"]:
    """Derivatives of the world rotation vector between two segments, at one pose."""
    segment, base = np.array(pairs, int).reshape(-1, 2).T
    return jnp.swapaxes(_relative_screws(body, frames(body, q), segment, base), 1, 2)


def _relative_screws(body: Body, f: Frames, segment: np.ndarray, base: np.ndarray) -> Array:
    """World axes of what turns a segment relative to another, (n, nv, 3)."""
    moves = np.asarray(body.topology.body_dofs, float)
    return (moves[segment] - moves[base])[:, :, None] * f.angular


def _angle_rates(R: Float[Array, "n 3 3"], turn: Float[Array, "3 n nv"]) -> Float[Array, "n 3 nv"]:
    """Rates of the angles of `R = Rz Rx Ry` for rotations given in its left frame.

    The angles turn about Z, then about X turned by z, then about Y turned by both.
    """
    cos_x = jnp.maximum(jnp.hypot(R[:, 0, 1], R[:, 1, 1]), _LEAST_COSINE)[:, None]
    sin_x, cos_z, sin_z = R[:, 2, 1, None], R[:, 1, 1, None] / cos_x, -R[:, 0, 1, None] / cos_x
    x = cos_z * turn[0] + sin_z * turn[1]
    y = (cos_z * turn[1] - sin_z * turn[0]) / cos_x
    return jnp.stack([turn[2] - sin_x * y, x, y], axis=1)
