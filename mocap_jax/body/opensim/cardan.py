"""Free and ball joints of OpenSim models, whose coordinates are angles in a fixed order.

A quaternion stands for the three angles in our poses. The order of axes, and the frames they belong
to, are kept in the MJCF's custom data, so that exports can give OpenSim its coordinates back.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.opensim.coordinates import Known
from mocap_jax.body.opensim.layout import leading_axis
from mocap_jax.body.opensim.model import GROUND, OsimJoint, TransformAxis

CARDAN_PREFIX = "opensim/cardan/"
"""Of the MJCF's custom texts (names of coordinates) and numbers (frames and axes), by joint."""


@dataclass(frozen=True)
class CardanJoint:
    """A free or ball joint and OpenSim's coordinates of it."""

    joint: str
    coordinates: tuple[str, ...]
    """Three angles, and of a free joint three shifts, in the order of the axes."""
    R_parent_frame: np.ndarray
    p_parent_frame: np.ndarray
    R_child_frame: np.ndarray
    p_child_frame: np.ndarray
    axes: Float[np.ndarray, "n 3"]
    lines: Float[np.ndarray, "n 2"]
    """(value at zero, slope) of turns and shifts as functions of their coordinates."""

    @property
    def kind(self) -> str:
        return "free" if len(self.coordinates) == 6 else "ball"

    def values(
        self, R_parent_child: Float[np.ndarray, "t 3 3"], p_parent_child: Float[np.ndarray, "t 3"]
    ) -> Float[np.ndarray, "t n"]:
        """Coordinates [rad, m] of child poses in the parent, angles without jumps."""
        R = self.R_parent_frame.T @ R_parent_child @ self.R_child_frame
        angles = _angles(R, self.axes[:3])
        p = p_parent_child + R_parent_child @ self.p_child_frame - self.p_parent_frame
        shifts = (p @ self.R_parent_frame) @ self.axes[3:].T
        both = np.concatenate([angles, shifts], axis=1)
        return (both - self.lines[:, 0]) / self.lines[:, 1]

    def pose(self, values: Float[np.ndarray, "n"]) -> tuple[np.ndarray, np.ndarray]:
        """Rotation and position [m] of the child in the parent with these coordinates."""
        amounts = self.lines[:, 0] + self.lines[:, 1] * values
        R = self.R_parent_frame
        for axis, angle in zip(self.axes[:3], amounts[:3], strict=True):
            R = R @ Rotation.from_rotvec(axis * angle).as_matrix()
        R = R @ self.R_child_frame.T
        shift = self.R_parent_frame @ (amounts[3:] @ self.axes[3:])
        return R, self.p_parent_frame + shift - R @ self.p_child_frame


def _angles(R: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Angles about three orthogonal axes, in order, of rotations R = R1 R2 R3."""
    sign = np.sign(np.linalg.det(axes))
    turned = axes @ R @ axes.T
    angles = np.array([_xyz(one) for one in turned]) * sign
    return np.unwrap(angles, axis=0)


def _xyz(R: np.ndarray) -> tuple[float, float, float]:
    """Intrinsic X-Y-Z angles; with the middle one at a right angle the last is zero."""
    cosine = np.hypot(R[0, 0], R[0, 1])
    y = np.arctan2(R[0, 2], cosine)
    if cosine < 1e-9:
        return float(np.arctan2(R[2, 1], R[1, 1])), float(y), 0.0
    return float(np.arctan2(-R[1, 2], R[2, 2])), float(y), float(np.arctan2(-R[0, 1], R[0, 0]))


def cardan_joint(joint: OsimJoint, known: dict[str, Known]) -> CardanJoint | None:
    """The joint as a free joint (six coordinates, on the ground) or a ball; None for others."""
    moving = [c.name for c in joint.coordinates if not known[c.name].fixed]
    free = joint.parent.body == GROUND and len(moving) == len(joint.coordinates) == 6
    ball = joint.kind == "BallJoint" and len(moving) == 3
    if not (free or ball) or any(known[c].follows for c in moving):
        return None
    axes = (*joint.rotations, *(joint.translations if free else ()))
    if any(_leads_nothing(joint, axis) for axis in axes):
        return None
    directions = np.array([a.axis for a in axes])
    for three in (directions[:3], directions[3:] if free else np.eye(3)):
        if np.abs(three @ three.T - np.eye(3)).max() > 1e-9:
            return None
    return CardanJoint(
        joint.name,
        tuple(a.coordinate or "" for a in axes),
        joint.parent.rotation.as_matrix(),
        joint.parent.position,
        joint.child.rotation.as_matrix(),
        joint.child.position,
        directions,
        np.array([a.function.line for a in axes]),
    )


def _leads_nothing(joint: OsimJoint, axis: TransformAxis) -> bool:
    return axis.coordinate is None or leading_axis(joint, axis.coordinate) is not axis


def cardan_elements(joint: CardanJoint) -> list[ElementTree.Element]:
    """What states the joint's coordinates in the `<custom>` section of an MJCF document."""
    name = CARDAN_PREFIX + joint.joint
    quats = [
        Rotation.from_matrix(R).as_quat(scalar_first=True)
        for R in (joint.R_parent_frame, joint.R_child_frame)
    ]
    data = np.concatenate(
        [quats[0], joint.p_parent_frame, quats[1], joint.p_child_frame,
         joint.axes.ravel(), joint.lines.ravel()]
    )  # fmt: skip
    text = numbers(data)
    return [
        ElementTree.Element("text", name=name, data=" ".join(joint.coordinates)),
        ElementTree.Element("numeric", name=name, data=text),
    ]


def cardan_joints(xml: str) -> dict[str, CardanJoint]:
    """Joints of an MJCF document whose OpenSim coordinates it states, by name."""
    if CARDAN_PREFIX not in xml:
        return {}
    custom = ElementTree.fromstring(xml).find("custom")
    if custom is None:
        return {}
    names = {e.get("name", ""): e.get("data", "").split() for e in custom.iter("text")}
    out = {}
    for element in custom.iter("numeric"):
        key = element.get("name", "")
        if not key.startswith(CARDAN_PREFIX) or key not in names:
            continue
        data = np.array([float(x) for x in element.get("data", "").split()])
        n = len(names[key])
        R = [Rotation.from_quat(data[i : i + 4], scalar_first=True).as_matrix() for i in (0, 7)]
        joint = key.removeprefix(CARDAN_PREFIX)
        out[joint] = CardanJoint(
            joint, tuple(names[key]), R[0], data[4:7], R[1], data[11:14],
            data[14 : 14 + 3 * n].reshape(n, 3), data[14 + 3 * n :].reshape(n, 2),
        )  # fmt: skip
    return out
