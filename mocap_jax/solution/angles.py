"""Joint angles over time, named as the ISB recommends (flexion, abduction, rotation)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.body.topology import HINGE
from mocap_jax.solution.anatomy import anatomical_frames, joint_angle_list, rotation_labels
from mocap_jax.solution.cardan import cardan_zxy, continuous, nearest_solution
from mocap_jax.solution.poses import root_segment, segment_poses
from mocap_jax.trajectory import Trajectory


def joint_rotations(
    body: Body, R_world: Float[np.ndarray, "t nbody 3 3"]
) -> Float[np.ndarray, "t nbody 3 3"]:
    """Rotation of every segment in its parent (`R_parent_child`); the world's own is unity."""
    parent = np.array(body.topology.body_parent)
    return np.swapaxes(R_world[:, parent], -1, -2) @ R_world


def anatomical_rotations(
    body: Body, R_parent_child: Float[np.ndarray, "t nbody 3 3"]
) -> Float[np.ndarray, "t nbody 3 3"]:
    """Rotation of every segment's anatomical frame in that of its parent (see `anatomy`)."""
    frames = anatomical_frames(body)
    parent = np.array(body.topology.body_parent)
    return np.swapaxes(frames[parent], -1, -2) @ R_parent_child @ frames


def root_relative_angles(
    body: Body,
    R_world: Float[np.ndarray, "t nbody 3 3"],
    segment: str,
    near: Float[np.ndarray, "t 3"] | None = None,
) -> tuple[tuple[str, ...], Float[np.ndarray, "t 3"]]:
    """Names and Z-X-Y angles [rad] of a segment relative to the root segment.

    Of the equivalent triples each frame takes the one nearest to `near` (angles of another motion
    at the same times, as this function returns them), or to the frame before.
    """
    frames = anatomical_frames(body)
    root, b = root_segment(body.topology), body.topology.body_index(segment)
    R_root_anatomical, R_anatomical = R_world[:, root] @ frames[root], R_world[:, b] @ frames[b]
    angles = cardan_zxy(np.swapaxes(R_root_anatomical, -1, -2) @ R_anatomical)
    labels = rotation_labels(segment)
    sign = np.array([s for _, s in labels])
    angles = continuous(angles) if near is None else nearest_solution(angles, near * sign)
    return tuple(n for n, _ in labels), angles * sign


def hinge_coordinate(body: Body, q: Float[np.ndarray, "t nq"], segment: int) -> np.ndarray:
    """Coordinate [rad] of the only hinge of a segment, over time."""
    topology = body.topology
    joint = next(j for j in topology.joints_of_body(segment) if topology.joint_types[j] == HINGE)
    return np.asarray(q)[:, topology.joint_qpos[joint]]


def joint_angles(
    body: Body, trajectory: Trajectory
) -> tuple[tuple[str, ...], Float[np.ndarray, "t n"]]:
    """Joint angles over time, without jumps.

    A joint of one degree of freedom gives its coordinate. Any other gives the three Z-X-Y Cardan
    angles of the child's anatomical frame in the parent's, zero when the body stands upright with
    hanging limbs (palms to the thighs). Positive are flexion, abduction, internal rotation and
    pronation on both sides; for the trunk and head flexion forward, bending to the right, turning
    to the left. Each frame takes the Cardan solution nearest to the frame before.

    Returns:
        (names `<segment>/<angle>`, angles [rad] of shape (t, n)).
    """
    q = np.asarray(trajectory.q)
    listed = joint_angle_list(body)
    R_world, _ = segment_poses(body, q)
    rotations = anatomical_rotations(body, joint_rotations(body, R_world))
    segments = np.array(sorted({a.segment for a in listed if a.axis >= 0}), int)
    cardan = continuous(cardan_zxy(rotations[:, segments]))
    columns = []
    for angle in listed:
        if angle.axis < 0:
            column = hinge_coordinate(body, q, angle.segment)
        else:
            column = cardan[:, np.searchsorted(segments, angle.segment), angle.axis]
        columns.append(angle.sign * column)
    stacked = np.stack(columns, axis=1) if columns else np.zeros((len(q), 0))
    return tuple(a.name for a in listed), stacked
