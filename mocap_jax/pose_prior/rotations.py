"""Rotations of joints in terms of anatomical frames, which all bodies share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import segment_poses


def anatomical_joint_rotations(
    body: Body, q: Float[np.ndarray, "t nq"], joints: Sequence[tuple[str, str]]
) -> Float[np.ndarray, "t j 3 3"]:
    """R_parent_child of anatomical frames over time, for pairs (child, parent) of segments.

    Raises:
        InputError: the body lacks a segment.
    """
    index = segment_pairs(body, joints)
    R_world_segment, _ = segment_poses(body, q)
    R_world_anatomical = R_world_segment @ anatomical_frames(body)
    child, parent = index.T
    return np.swapaxes(R_world_anatomical[:, parent], -1, -2) @ R_world_anatomical[:, child]


def rotation_vectors(
    mean: Float[np.ndarray, "j 3 3"], rotation: Float[np.ndarray, "*b j 3 3"]
) -> Float[np.ndarray, "*b 3j"]:
    """Rotation vectors [rad] from the mean to given rotations of all joints, laid end to end."""
    away = np.swapaxes(mean, -1, -2) @ rotation
    vectors = Rotation.from_matrix(away.reshape(-1, 3, 3)).as_rotvec()
    return vectors.reshape(*away.shape[:-3], 3 * len(mean))


def segment_pairs(body: Body, joints: Sequence[tuple[str, str]]) -> np.ndarray:
    """Body indices (j, 2) of the children and parents.

    Raises:
        InputError: the body lacks a segment, or a parent is no ancestor of its child.
    """
    topology = body.topology
    names = topology.body_names
    for name in (n for pair in joints for n in pair):
        if name not in names:
            raise unknown_name("segment", name, names[1:])
    known = set(joints_of(body, joints))
    for child, parent in joints:
        if (child, parent) not in known:
            raise InputError(f"pose prior: '{parent}' is no ancestor of '{child}' in this body")
    return np.array([[names.index(c), names.index(p)] for c, p in joints], int).reshape(-1, 2)


def joints_of(body: Body, joints: Sequence[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    """Those pairs (child, parent) that a body has, the parent above the child in its tree."""
    topology = body.topology
    names = topology.body_names

    def has(child: str, parent: str) -> bool:
        if child not in names or parent not in names:
            return False
        at, wanted = topology.body_parent[names.index(child)], names.index(parent)
        while at not in (0, wanted):
            at = topology.body_parent[at]
        return at == wanted

    return tuple(pair for pair in joints if has(*pair))
