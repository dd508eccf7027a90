"""Arrays of poses assembled from the tracks of single joints."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, Topology
from mocap_jax.body.topology import QPOS_WIDTH

_MARGIN = math.radians(5.0)


def assemble_poses(
    topology: Topology, joints: dict[str, Float[np.ndarray, "t n"]]
) -> Float[np.ndarray, "t nq"]:
    """Poses from every joint's coordinates, with quaternions that do not change sign in time."""
    q = np.zeros((len(next(iter(joints.values()))), topology.nq))
    for j, name in enumerate(topology.joint_names):
        start = topology.joint_qpos[j]
        q[:, start : start + QPOS_WIDTH[topology.joint_types[j]]] = joints[name]
    return continuous_quaternions(topology, q)


def continuous_quaternions(
    topology: Topology, q: Float[np.ndarray, "t nq"]
) -> Float[np.ndarray, "t nq"]:
    """Flip the sign of quaternions so that each stays near its predecessor; the first has w > 0."""
    q = np.array(q)
    for index in topology.quat_index[0]:
        quat = q[:, index]
        steps = np.sign((quat[1:] * quat[:-1]).sum(axis=1))
        first = -1.0 if quat[0, 0] < 0 else 1.0
        signs = np.cumprod(np.concatenate([[first], np.where(steps < 0, -1.0, 1.0)]))
        q[:, index] = quat * signs[:, None]
    return q


def unwrap_angle(angle: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t"]:
    """Angle [rad] without jumps of full turns, its median in (-pi, pi]."""
    angle = np.unwrap(angle)
    return angle - 2 * np.pi * np.round(np.median(angle) / (2 * np.pi))


def widened_range(
    limits: tuple[float, float], track: Float[np.ndarray, "t n"]
) -> tuple[float, float]:
    """Limits [rad] that include a clip: each one that it oversteps moves 5 degrees past it."""
    lower, upper = limits
    if track.shape[1] == 4:
        largest = float(2 * np.arccos(np.clip(np.abs(track[:, 0]), 0, 1)).max())
        return limits if largest <= upper else (lower, min(largest + _MARGIN, math.pi))
    low, high = float(track.min()), float(track.max())
    return (
        low - _MARGIN if low < lower else lower,
        high + _MARGIN if high > upper else upper,
    )


def segment_frames(
    body: Body, q: Float[np.ndarray, "t nq"], chosen: np.ndarray
) -> tuple[Float[np.ndarray, "t n 3 3"], Float[np.ndarray, "t n 3"]]:
    """World rotations and joint centres [m] of some bodies, by C MuJoCo."""
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    R, p = np.empty((len(q), len(chosen), 3, 3)), np.empty((len(q), len(chosen), 3))
    for k, pose in enumerate(q):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        R[k], p[k] = data.xmat[chosen].reshape(-1, 3, 3), data.xpos[chosen]
    return R, p
