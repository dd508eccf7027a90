"""Body frames of whole trajectories in NumPy: `body.frames` would be compiled for every file."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body


def world_frames(
    body: Body, q: Float[np.ndarray, "t nq"]
) -> tuple[Float[np.ndarray, "t nbody 3 3"], Float[np.ndarray, "t nbody 3"]]:
    """World rotations and positions [m] of all bodies over time."""
    topology = body.topology
    R_world = np.tile(np.eye(3), (len(q), topology.nbody, 1, 1))
    p_world = np.zeros((len(q), topology.nbody, 3))
    body_R = _matrices(np.asarray(body.body_quat))
    body_pos = np.asarray(body.body_pos)
    for b in range(1, topology.nbody):
        parent = topology.body_parent[b]
        R = R_world[:, parent] @ body_R[b]
        p = p_world[:, parent] + R_world[:, parent] @ body_pos[b]
        for joint in topology.joints_of_body(b):
            R, p = _move(body, joint, q, R, p)
        R_world[:, b], p_world[:, b] = R, p
    return R_world, p_world


def _move(
    body: Body, joint: int, q: np.ndarray, R: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Frame after the motion of one joint."""
    kind, at = body.topology.joint_types[joint], int(body.topology.joint_qpos[joint])
    if kind == "free":
        return _matrices(q[:, at + 3 : at + 7]), q[:, at : at + 3]
    axis, pivot = np.asarray(body.joint_axis)[joint], np.asarray(body.joint_pos)[joint]
    shift = q[:, at] - float(body.qpos0[at])
    if kind == "slide":
        return R, p + (R @ axis) * shift[:, None]
    if kind == "ball":
        R_after = R @ _matrices(q[:, at : at + 4])
    else:
        R_after = R @ Rotation.from_rotvec(shift[:, None] * axis).as_matrix()
    return R_after, p + R @ pivot - R_after @ pivot


def relative_frames(
    body: Body, q: Float[np.ndarray, "t nq"]
) -> tuple[Float[np.ndarray, "t n 3"], Float[np.ndarray, "t n 4"]]:
    """Translations [m] and rotations (wxyz) of all n bodies but the world in their parents."""
    rotation, position = world_frames(body, q)
    parent = np.array(body.topology.body_parent[1:], int)
    R_parent_world = np.swapaxes(rotation[:, parent], -1, -2)
    translation = R_parent_world @ (position[:, 1:] - position[:, parent])[..., None]
    relative = (R_parent_world @ rotation[:, 1:]).reshape(-1, 3, 3)
    if not len(relative):
        return translation[..., 0], np.zeros((*translation.shape[:2], 4))
    quaternion = Rotation.from_matrix(relative).as_quat(canonical=True)
    return translation[..., 0], np.roll(quaternion, 1, axis=1).reshape(*translation.shape[:2], 4)


def _matrices(wxyz: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(np.roll(wxyz, -1, axis=-1)).as_matrix()
