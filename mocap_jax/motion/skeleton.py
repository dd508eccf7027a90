"""`Skeleton`: a tree of bones with joints, written as MJCF text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, load_body
from mocap_jax.body.mjcf_text import numbers

# Rotation from the files' axes (X left, Y up, Z forward) to ours (X forward, Y left, Z up).
R_WORLD_FILE = Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
ROOT_JOINT = "root"
TIP_PREFIX = "tip/"
"""Of the MJCF's custom numeric data that keep the tips of bones, each in its bone's frame [m]."""


@dataclass(frozen=True)
class Joint:
    """A ball joint, or a hinge about an axis of the bone's frame, at the bone's origin."""

    name: str
    axis: tuple[float, float, float] | None = None
    """None for a ball joint."""
    range: tuple[float, float] | None = None
    """Limits [rad]; (0, largest angle) for a ball joint; None when unlimited."""


@dataclass(frozen=True)
class Capsule:
    """A capsule in its bone's frame [m]; a sphere when both ends coincide."""

    start: np.ndarray
    end: np.ndarray
    radius: float
    mass: float | None = None
    """[kg]; None takes it from the volume, at the density of water."""


@dataclass(frozen=True)
class Inertia:
    """Mass of a bone and how it is spread; without one, MuJoCo takes both from the capsules."""

    mass: float
    """[kg]"""
    centre: np.ndarray
    """Centre of mass in the bone's frame [m]."""
    moments: np.ndarray
    """About the centre, for axes parallel to the bone's X, Y and Z [kg m^2]."""


@dataclass(frozen=True)
class Bone:
    """One rigid segment: `R_parent_bone` and `position` place it in its parent at zero pose."""

    name: str
    parent: str | None
    """None for the root, which gets the free joint."""
    position: np.ndarray
    rotation: Rotation
    joints: tuple[Joint, ...] = ()
    end: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """Far end in the bone's frame [m]; the segment runs from the origin to here."""
    inertia: Inertia | None = None
    tip: np.ndarray | None = None
    """Far end [m] of a bone that nothing follows, to be kept in the MJCF."""


@dataclass(frozen=True)
class Skeleton:
    """Bones, parents before children, the root first. The root's placement is the world's."""

    name: str
    bones: tuple[Bone, ...]

    def bone(self, name: str) -> Bone:
        """Bone of that name."""
        return next(b for b in self.bones if b.name == name)

    def children(self, name: str) -> list[Bone]:
        """Bones attached to the one of that name."""
        return [b for b in self.bones if b.parent == name]

    def zero_pose(self) -> dict[str, tuple[Rotation, np.ndarray]]:
        """World frame (R_world_bone, position [m]) of every bone with all joints at zero."""
        frames: dict[str, tuple[Rotation, np.ndarray]] = {}
        for bone in self.bones:
            R, p = frames.get(bone.parent or "", (Rotation.identity(), np.zeros(3)))
            frames[bone.name] = (R * bone.rotation, p + R.apply(bone.position))
        return frames


Shapes = Mapping[str, Iterable[Capsule]]


def skeleton_body(skeleton: Skeleton, shapes: Shapes) -> Body:
    """Compile a skeleton with the capsules of its bones; at qpos0 it stands on z = 0."""
    return load_body(skeleton_mjcf(skeleton, shapes))


def skeleton_mjcf(skeleton: Skeleton, shapes: Shapes) -> str:
    """MJCF text of a skeleton; the root is raised so that its lowest capsule touches z = 0."""
    mujoco = ElementTree.Element("mujoco", model=skeleton.name)
    ElementTree.SubElement(mujoco, "compiler", angle="radian", autolimits="true")
    default = ElementTree.SubElement(mujoco, "default")
    # Shapes are for occlusion, pictures and inertia; nothing collides.
    ElementTree.SubElement(default, "geom", type="capsule", group="2", contype="0",
                           conaffinity="0", density="1000", rgba="0.75 0.68 0.62 1")  # fmt: skip
    elements = {"": ElementTree.SubElement(mujoco, "worldbody")}
    lift = np.array([0.0, 0.0, -_lowest_point(skeleton, shapes)])
    for bone in skeleton.bones:
        position = bone.position + (lift if bone.parent is None else 0.0)
        element = ElementTree.SubElement(
            elements[bone.parent or ""], "body", name=bone.name,
            pos=numbers(position), quat=numbers(bone.rotation.as_quat(scalar_first=True)),
        )  # fmt: skip
        elements[bone.name] = element
        _add_inertia(element, bone)
        _add_joints(element, bone)
        for i, capsule in enumerate(shapes[bone.name]):
            _add_capsule(element, f"{bone.name}/{i}", capsule)
    _add_tips(mujoco, skeleton)
    ElementTree.indent(mujoco)
    return ElementTree.tostring(mujoco, encoding="unicode")


def _add_inertia(element: ElementTree.Element, bone: Bone) -> None:
    if bone.inertia is not None:
        ElementTree.SubElement(
            element, "inertial", pos=numbers(bone.inertia.centre),
            mass=numbers([bone.inertia.mass]), diaginertia=numbers(bone.inertia.moments),
        )  # fmt: skip


def _add_tips(mujoco: ElementTree.Element, skeleton: Skeleton) -> None:
    tips = {bone.name: bone.tip for bone in skeleton.bones if bone.tip is not None}
    custom = ElementTree.SubElement(mujoco, "custom") if tips else mujoco
    for name, tip in tips.items():
        ElementTree.SubElement(custom, "numeric", name=TIP_PREFIX + name, data=numbers(tip))


def _add_joints(element: ElementTree.Element, bone: Bone) -> None:
    if bone.parent is None:
        ElementTree.SubElement(element, "freejoint", name=ROOT_JOINT)
    for joint in bone.joints:
        node = ElementTree.SubElement(element, "joint", name=joint.name)
        if joint.axis is None:
            node.set("type", "ball")
        else:
            node.set("type", "hinge")
            node.set("axis", numbers(joint.axis))
        if joint.range is not None:
            node.set("range", numbers(joint.range))


def _add_capsule(element: ElementTree.Element, name: str, capsule: Capsule) -> None:
    node = ElementTree.SubElement(element, "geom", name=name)
    if np.linalg.norm(capsule.end - capsule.start) > 1e-3:
        node.set("fromto", numbers([*capsule.start, *capsule.end]))
    else:
        node.set("type", "sphere")
        node.set("pos", numbers(capsule.start))
    node.set("size", numbers([capsule.radius]))
    if capsule.mass is not None:
        node.set("mass", numbers([capsule.mass]))


def _lowest_point(skeleton: Skeleton, shapes: Shapes) -> float:
    heights = [
        p[2] + R.apply(point)[2] - capsule.radius
        for name, (R, p) in skeleton.zero_pose().items()
        for capsule in shapes[name]
        for point in (capsule.start, capsule.end)
    ]
    return float(min(heights))
