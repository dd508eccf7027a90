"""An arm bent the wrong way: the mirror image about the line from shoulder to wrist.

A wrist position has two arms, and a filter that knows no joint limits may come out of full
extension on the wrong one. The image with the elbow in its range has the same wrist at all times.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.arm.errors import arm_points
from mocap_jax.body import Body
from mocap_jax.motion.arm import ELBOW, FLEXION_AXIS, ROTATION, SHOULDER
from mocap_jax.solution import Solution


def bent_forward(solution: Solution) -> Solution:
    """The solution with its mirror image taken where the elbow is bent backwards.

    Poses and their covariances are mirrored; velocities are kept where they were. Shoulders of
    three hinges are left as they are: filters keep their elbows in range (`EkfOptions.limits`).
    """
    topology = solution.body.topology
    if ROTATION in topology.joint_names:
        return solution
    elbow = topology.joint_qpos[topology.joint_names.index(ELBOW)]
    q = np.array(solution.trajectory.q)
    wrong = q[:, elbow] < 0
    if not wrong.any():
        return solution
    turn, slope = _line(solution.body, q[wrong])
    q[wrong] = _mirrored(solution.body, q[wrong], turn)
    covariance = solution.covariance
    if covariance is not None:
        covariance = np.array(covariance)
        J = _change(solution.body, turn, slope)
        covariance[wrong] = J @ covariance[wrong] @ np.swapaxes(J, 1, 2)
    return dataclasses.replace(
        solution,
        trajectory=dataclasses.replace(solution.trajectory, q=q),
        covariance=covariance,
        pair_covariance=None,
    )  # type: ignore[arg-type]


def _line(body: Body, q: Float[np.ndarray, "t nq"]) -> tuple[np.ndarray, np.ndarray]:
    """Angle from the upper arm to the line to the wrist [rad], and its slope by the elbow angle."""
    topology = body.topology
    points = arm_points(body, np.asarray(body.qpos0)[None])
    l1 = float(np.linalg.norm(points.elbow - points.shoulder))
    l2 = float(np.linalg.norm(points.wrist - points.elbow))
    bend = q[:, topology.joint_qpos[topology.joint_names.index(ELBOW)]]
    along, across = l1 + l2 * np.cos(bend), l2 * np.sin(bend)
    slope = (l2**2 + l1 * l2 * np.cos(bend)) / (along**2 + across**2)
    return np.arctan2(across, along), slope


def _mirrored(body: Body, q: np.ndarray, turn: np.ndarray) -> np.ndarray:
    topology, out = body.topology, q.copy()
    joint = topology.joint_names.index(SHOULDER)
    at = topology.joint_qpos[joint]
    if topology.joint_types[joint] == "ball":
        by = np.asarray(so3.quat_exp(2 * turn[:, None] * np.array(FLEXION_AXIS)))
        out[:, at : at + 4] = so3.quat_multiply(q[:, at : at + 4], by)
    else:
        out[:, at] += 2 * turn
    elbow = topology.joint_qpos[topology.joint_names.index(ELBOW)]
    out[:, elbow] *= -1
    return out


def _change(body: Body, turn: np.ndarray, slope: np.ndarray) -> Float[np.ndarray, "t nv nv"]:
    """How errors of a pose show in those of its mirror image."""
    topology = body.topology
    joint = topology.joint_names.index(SHOULDER)
    at = topology.joint_dof[joint]
    elbow = topology.joint_dof[topology.joint_names.index(ELBOW)]
    J = np.tile(np.eye(body.nv), (len(turn), 1, 1))
    J[:, elbow, elbow] = -1
    if topology.joint_types[joint] == "ball":
        axis = np.array(FLEXION_AXIS)
        J[:, at : at + 3, at : at + 3] = so3.exp(-2 * turn[:, None] * axis)
        J[:, at : at + 3, elbow] = 2 * slope[:, None] * axis
    else:
        J[:, at, elbow] = 2 * slope
    return J
