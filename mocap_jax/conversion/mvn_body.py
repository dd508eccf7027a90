"""The body of an MVN character, and MVN's segment poses as its truth."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from mocap_jax import so3
from mocap_jax.body import Body, load_body
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.errors import InputError
from mocap_jax.io.convert import SegmentPoses
from mocap_jax.recording import Truth
from mocap_jax.trajectory import Trajectory

PARENTS = {
    "L5": "Pelvis", "L3": "L5", "T12": "L3", "T8": "T12", "Neck": "T8", "Head": "Neck",
    "RightShoulder": "T8", "RightUpperArm": "RightShoulder", "RightForeArm": "RightUpperArm",
    "RightHand": "RightForeArm", "LeftShoulder": "T8", "LeftUpperArm": "LeftShoulder",
    "LeftForeArm": "LeftUpperArm", "LeftHand": "LeftForeArm", "RightUpperLeg": "Pelvis",
    "RightLowerLeg": "RightUpperLeg", "RightFoot": "RightLowerLeg", "RightToe": "RightFoot",
    "LeftUpperLeg": "Pelvis", "LeftLowerLeg": "LeftUpperLeg", "LeftFoot": "LeftLowerLeg",
    "LeftToe": "LeftFoot",
}  # fmt: skip
"""MVN's tree of 23 segments."""


def mvn_body(poses: SegmentPoses | None, where: str) -> Body:
    """The character as a body: a free pelvis, ball joints, offsets of its aligned pose.

    Args:
        poses: of the file.
        where: the file, for messages.

    Raises:
        InputError: the file has no segment poses, no aligned pose, or other segments.
    """
    if poses is None or poses.offsets is None:
        raise InputError(
            f"{where}: no body can be made of it: it lacks segment poses, or a pose of the "
            "character that is aligned with the world (frame type 'identity')"
        )
    if poses.names[0] != "Pelvis" or any(n not in PARENTS for n in poses.names[1:]):
        raise InputError(f"{where}: segments {', '.join(poses.names[:24])} are not MVN's 23")
    root = ElementTree.Element("mujoco", model="mvn_character")
    world = ElementTree.SubElement(root, "worldbody")
    elements: dict[str, ElementTree.Element] = {}
    place = dict(zip(poses.names, np.asarray(poses.offsets), strict=True))
    for name in poses.names:
        parent = PARENTS.get(name)
        offset = place[name] - (place[parent] if parent else 0.0)
        above = elements[parent] if parent else world
        element = ElementTree.SubElement(above, "body", name=name, pos=numbers(offset))
        if parent:
            ElementTree.SubElement(element, "joint", name=name, type="ball")
        else:
            ElementTree.SubElement(element, "freejoint", name="root")
        ElementTree.SubElement(
            element, "inertial", pos="0 0 0", mass="1", diaginertia="0.01 0.01 0.01"
        )
        elements[name] = element
    return load_body(ElementTree.tostring(root, encoding="unicode"))


def truth_on(body: Body, poses: SegmentPoses, start: float) -> Truth | None:
    """Segment poses as the trajectory of a body; None where the body cannot carry them.

    It can if its segments have the names of the file, a ball joint each at its origin and a free
    root, and are aligned with the world in the reference pose.

    Args:
        body: with or without sites.
        poses: of the file.
        start: file time that is the recording's zero [s].
    """
    topology = body.topology
    names = topology.body_names[1:]
    if not body.has_free_root or any(n not in poses.names for n in names):
        return None
    if topology.joint_types[1:] != ("ball",) * (len(names) - 1):
        return None
    if not (np.allclose(body.body_quat, [1, 0, 0, 0]) and np.allclose(body.joint_pos, 0)):
        return None
    at = [poses.names.index(n) for n in names]
    R_world_segment = so3.quat_normalise(np.asarray(poses.orientation)[:, at])
    columns = [np.asarray(poses.position)[:, at[0]], np.asarray(R_world_segment[:, 0])]
    for i in range(1, len(names)):
        parent = topology.body_parent[i + 1] - 1
        turn = so3.quat_multiply(so3.quat_conjugate(R_world_segment[:, parent]),
                                 R_world_segment[:, i])  # fmt: skip
        columns.append(np.asarray(turn))
    trajectory = Trajectory(np.asarray(poses.time) - start, np.concatenate(columns, axis=1))
    return Truth(trajectory, body.xml)
