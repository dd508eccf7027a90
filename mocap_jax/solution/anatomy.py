"""Anatomical frames of segments and the names of their joint angles.

The frames are those of the ISB recommendations (Wu et al. 2002, 2005): X forward, Y up (along the
long axis, towards the trunk), Z to the right, all segments aligned when the body stands upright
with its limbs hanging. They are found from the model's reference pose `qpos0`, whatever it is (a
T-pose, for example): the body's own axes come from the hips and the head, and limb segments are
turned, by the smallest rotation, from "hanging" to where the model's reference pose has them.
Bodies without the known segment names get the world's axes (X forward, Z up).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.body.topology import DOF_WIDTH, HINGE, SLIDE
from mocap_jax.solution.poses import joint_segments, root_segment, segment_poses

# A body axis closer to a coordinate axis than this is taken to be that axis.
_SNAP = np.deg2rad(20.0)

# Long axis of a limb segment: from its own joint to the joint of the segment named here.
_LONG_AXIS = {
    "UpperArm": ("UpperArm", "ForeArm"),
    "ForeArm": ("ForeArm", "Hand"),
    "Hand": ("ForeArm", "Hand"),
    "UpperLeg": ("UpperLeg", "LowerLeg"),
    "LowerLeg": ("LowerLeg", "Foot"),
}

# Names of the rotations about Z, X and Y, and the sign that makes them positive on the right.
_LIMB = (("flexion", 1), ("abduction", -1), ("internal_rotation", 1))
_NAMES = {
    "UpperArm": _LIMB,
    "UpperLeg": _LIMB,
    "ForeArm": (("flexion", 1), ("abduction", -1), ("pronation", 1)),
    # With the arm hanging the palm faces the thigh, so the hand flexes about X.
    "Hand": (("radial_deviation", 1), ("flexion", 1), ("pronation", 1)),
    "LowerLeg": (("flexion", -1), ("abduction", -1), ("internal_rotation", 1)),
    "Foot": (("dorsiflexion", 1), ("eversion", -1), ("internal_rotation", 1)),
    "Toe": (("extension", 1), ("eversion", -1), ("internal_rotation", 1)),
    "Shoulder": (("axial_rotation", 1), ("depression", 1), ("protraction", 1)),
}
# Segments of OpenSim's models, named `femur_r` and so on; they stand upright at reference.
_OPENSIM = {
    "humerus": "UpperArm", "ulna": "ForeArm", "radius": "ForeArm", "hand": "Hand",
    "femur": "UpperLeg", "tibia": "LowerLeg", "talus": "Foot", "calcn": "Foot", "toes": "Toe",
}  # fmt: skip
_AXIAL = (("flexion", -1), ("lateral_bending", 1), ("axial_rotation", 1))


@dataclass(frozen=True)
class JointAngle:
    """One reported joint angle."""

    name: str
    """`<segment>/<angle>`, for example `RightUpperArm/abduction`."""
    segment: int
    """Body index of the child segment."""
    axis: int
    """0, 1, 2: rotation about Z, X, Y of the Cardan sequence; -1: coordinate of a single hinge."""
    sign: int
    """What makes the named direction positive (left limbs mirror right ones)."""


def _side_and_part(name: str) -> tuple[str, str]:
    for side in ("Right", "Left"):
        if name.startswith(side) and name.removeprefix(side) in _NAMES:
            return side, name.removeprefix(side)
    part = _OPENSIM.get(name[:-2], "")
    if part and name[-2:] in ("_r", "_l"):
        return "Right" if name.endswith("_r") else "Left", part
    return "", ""


def rotation_labels(name: str) -> tuple[tuple[str, int], ...]:
    """Names and signs of the rotations about Z, X and Y of a segment."""
    side, part = _side_and_part(name)
    if not part:
        return _AXIAL
    (z, s_z), (x, s_x), (y, s_y) = _NAMES[part]
    mirror = -1 if side == "Left" else 1
    return (z, s_z), (x, s_x * mirror), (y, s_y * mirror)


def _snapped(direction: np.ndarray) -> np.ndarray:
    direction = direction / np.linalg.norm(direction)
    k = int(np.argmax(np.abs(direction)))
    axis = np.eye(3)[k] * np.sign(direction[k])
    return axis if direction @ axis > np.cos(_SNAP) else direction


def _body_axes(names: tuple[str, ...], position: Float[np.ndarray, "nbody 3"]) -> np.ndarray:
    """World directions (columns) of forward, up and right in the reference pose."""
    at = {name: position[i] for i, name in enumerate(names)}
    right, up = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    for part in ("UpperLeg", "UpperArm"):
        if {f"Right{part}", f"Left{part}"} <= at.keys():
            across = at[f"Right{part}"] - at[f"Left{part}"]
            if np.linalg.norm(across) > 1e-6:
                right = _snapped(across)
                break
    for top in ("Head", "Neck", "T8"):
        if top in at and "Pelvis" in at and np.linalg.norm(at[top] - at["Pelvis"]) > 1e-6:
            up = _snapped(at[top] - at["Pelvis"])
            break
    up = up - right * (up @ right)
    if np.linalg.norm(up) < 1e-3:
        right, up = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    up = up / np.linalg.norm(up)
    return np.stack([np.cross(up, right), up, right], axis=1)


def _smallest_rotation(a: np.ndarray, b: np.ndarray, fallback: np.ndarray) -> np.ndarray:
    """Rotation matrix that turns unit vector a to unit vector b the shortest way."""
    v, c = np.cross(a, b), float(a @ b)
    if c < -1 + 1e-9:
        return 2 * np.outer(fallback, fallback) - np.eye(3)
    V = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + V + V @ V / (1 + c)


def _world_anatomical(
    names: tuple[str, ...], position: np.ndarray
) -> Float[np.ndarray, "nbody 3 3"]:
    """Anatomical axes of every segment in the world, in the reference pose."""
    axes = _body_axes(names, position)
    out = np.repeat(axes[None], len(names), axis=0)
    index = {name: i for i, name in enumerate(names)}
    for i, name in enumerate(names):
        side, part = _side_and_part(name)
        upper, lower = _LONG_AXIS.get(part, ("", ""))
        if not upper or side + upper not in index or side + lower not in index:
            continue
        along = position[index[side + lower]] - position[index[side + upper]]
        if (length := np.linalg.norm(along)) > 1e-6:
            out[i] = _smallest_rotation(-axes[:, 1], along / length, axes[:, 0]) @ axes
    return out


def anatomical_frames(body: Body) -> Float[np.ndarray, "nbody 3 3"]:
    """`R_segment_anatomical` of every segment (constant: the frames are fixed to the segments)."""
    R_world, position = segment_poses(body, np.asarray(body.qpos0)[None])
    anatomical = _world_anatomical(body.topology.body_names, position[0])
    out = np.swapaxes(R_world[0], -1, -2) @ anatomical
    if body.has_free_root:
        return out
    # A body mounted on the world: the world itself keeps the body's axes.
    out[0] = anatomical[root_segment(body.topology)]
    return out


def joint_angle_list(body: Body) -> tuple[JointAngle, ...]:
    """The angles reported for a body, in its order.

    A joint of one rotational degree of freedom has one angle, named after the anatomical axis
    nearest to its hinge axis; every other joint that rotates has three (Z-X-Y). Slides have none.
    """
    topology = body.topology
    frames = anatomical_frames(body)
    out: list[JointAngle] = []
    for b in joint_segments(topology):
        name = topology.body_names[b]
        joints = [j for j in topology.joints_of_body(b) if topology.joint_types[j] != SLIDE]
        labels = rotation_labels(name)
        if len(joints) == 1 and topology.joint_types[joints[0]] == HINGE:
            axis = frames[b].T @ np.asarray(body.joint_axis)[joints[0]]
            zxy = axis[[2, 0, 1]]
            k = int(np.argmax(np.abs(zxy)))
            sign = labels[k][1] * (1 if zxy[k] > 0 else -1)
            out.append(JointAngle(f"{name}/{labels[k][0]}", b, -1, sign))
        elif sum(DOF_WIDTH[topology.joint_types[j]] for j in joints) > 1:
            out += [JointAngle(f"{name}/{n}", b, k, s) for k, (n, s) in enumerate(labels)]
    return tuple(out)
