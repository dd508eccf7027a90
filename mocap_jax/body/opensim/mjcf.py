"""An OpenSim model as MJCF text: Z up, X forward, its own names for bodies and coordinates."""

from __future__ import annotations

import dataclasses
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body.coupling import coupling_elements
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.opensim.cardan import CardanJoint, cardan_elements, cardan_joint
from mocap_jax.body.opensim.coordinates import Known, known_coordinates
from mocap_jax.body.opensim.document import read_osim
from mocap_jax.body.opensim.layout import Layout, joint_layout, leading_axis, welded_layout
from mocap_jax.body.opensim.model import GROUND, OsimBody, OsimJoint, OsimModel, Placement
from mocap_jax.body.opensim.shapes import add_shapes
from mocap_jax.errors import InputError

# OpenSim's ground (X forward, Y up, Z right) in our world (X forward, Y left, Z up).
R_WORLD_GROUND = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
PIVOT_PREFIX = "opensim/pivot_error/"
"""Of the MJCF's custom numbers: largest and root-mean-square error of a pivot [m], by joint."""
MODEL = "opensim/model"
"""The MJCF's custom text that names the OpenSim model it was made from."""
WELDED = "opensim/welded"
"""The MJCF's custom text that lists the bodies held in their default pose."""
# Bodies lighter than this [kg] get this mass, which MuJoCo asks for.
_LEAST_MASS, _LEAST_INERTIA = 1e-6, 1e-9


def opensim_mjcf(text: str, name: str) -> str:
    """MJCF text of an OpenSim model (`.osim`).

    Args:
        text: the document.
        name: of the file, for messages.

    Raises:
        InputError: what is wrong, or which feature is not represented, and where.
    """
    model = read_osim(text, name)
    known = known_coordinates(model, name)
    joints = _tree(model, name)
    root = Element("mujoco", model=model.name)
    # Models carry inertias that no rigid body can have: MuJoCo would refuse them.
    SubElement(root, "compiler", angle="radian", autolimits="true", balanceinertia="true")
    SubElement(root, "option", gravity=numbers(R_WORLD_GROUND.apply(model.gravity)))
    default = SubElement(root, "default")
    SubElement(default, "geom", type="capsule", group="2", contype="0", conaffinity="0",
               rgba="0.75 0.68 0.62 1")  # fmt: skip
    elements = {GROUND: SubElement(root, "worldbody")}
    custom = Element("custom")
    SubElement(custom, "text", name=MODEL, data=model.name)
    welded = []
    for joint in joints:
        element = SubElement(elements[joint.parent.body], "body", name=joint.child.body)
        elements[joint.child.body] = element
        leaf = all(j.parent.body != joint.child.body for j in joints)
        if _add_joint(element, custom, _in_world(joint), known, name, leaf=leaf):
            welded.append(joint.child.body)
        body = model.bodies[joint.child.body]
        _add_inertia(element, body)
        for site, placement in body.frames:
            SubElement(element, "site", name=site, pos=numbers(placement.position),
                       quat=_quaternion(placement.rotation))  # fmt: skip
    add_shapes(elements, model, joints)
    if welded:
        SubElement(custom, "text", name=WELDED, data=" ".join(welded))
    root.append(custom)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode")


def _in_world(joint: OsimJoint) -> OsimJoint:
    """A joint to the ground with its parent frame in our world."""
    if joint.parent.body != GROUND:
        return joint
    frame = joint.parent
    turned = Placement(
        GROUND, R_WORLD_GROUND * frame.rotation, R_WORLD_GROUND.apply(frame.position)
    )
    return dataclasses.replace(joint, parent=turned)


def _tree(model: OsimModel, name: str) -> list[OsimJoint]:
    """Joints with parents before children.

    Raises:
        InputError: a body without a joint, or with two (a loop), or joints that reach no ground.
    """
    by_child: dict[str, OsimJoint] = {}
    for joint in model.joints:
        if joint.child.body in by_child:
            raise InputError(
                f"{name}: body '{joint.child.body}' is the child of two joints "
                f"('{by_child[joint.child.body].name}' and '{joint.name}'); loops are not supported"
            )
        by_child[joint.child.body] = joint
    alone = [b for b in model.bodies if b not in by_child]
    if alone:
        raise InputError(f"{name}: body '{alone[0]}' is the child of no joint")
    placed, ordered = {GROUND}, []
    left = list(model.joints)
    while left:
        ready = [j for j in left if j.parent.body in placed]
        if not ready:
            raise InputError(f"{name}: joint '{left[0].name}' hangs on nothing that reaches ground")
        ordered += ready
        placed |= {j.child.body for j in ready}
        left = [j for j in left if j not in ready]
    return ordered


def _add_joint(
    element: Element, custom: Element, joint: OsimJoint, known: dict[str, Known], name: str, *,
    leaf: bool,
) -> bool:  # fmt: skip
    """Place a body and add its joints; return whether it was welded for want of a joint."""
    where = f"{name}: joint '{joint.name}'"
    whole = cardan_joint(joint, known)
    if whole is not None:
        _add_whole_joint(element, custom, joint, whole, known)
        return False
    moving = [c.name for c in joint.coordinates if not known[c.name].fixed]
    unmeasured = any(leading_axis(joint, c) is None for c in moving)
    # A kneecap: nothing hangs on it, and it only follows.
    weld = leaf and unmeasured and all(known[c].follows for c in moving)
    layout = welded_layout(joint, known) if weld else joint_layout(joint, known, where)
    _place(element, layout)
    for axis in layout.axes:
        node = SubElement(element, "joint", name=axis.name, type=axis.kind,
                          pos=numbers(layout.anchor), axis=numbers(axis.axis),
                          ref=numbers([axis.reference]))  # fmt: skip
        if axis.range is not None:
            node.set("range", numbers(axis.range))
    for coupling in layout.couplings:
        custom.extend(coupling_elements(coupling))
    if layout.pivot_error is not None:
        SubElement(custom, "numeric", name=PIVOT_PREFIX + joint.name,
                   data=numbers(layout.pivot_error))  # fmt: skip
    return weld


def _add_whole_joint(
    element: Element, custom: Element, joint: OsimJoint, whole: CardanJoint,
    known: dict[str, Known],
) -> None:  # fmt: skip
    """A free or ball joint, with what turns its pose into OpenSim's coordinates."""
    layout = welded_layout(joint, known)
    _place(element, layout)
    if whole.kind == "free":
        SubElement(element, "freejoint", name=joint.name)
    else:
        SubElement(element, "joint", name=joint.name, type="ball", pos=numbers(layout.anchor))
    custom.extend(cardan_elements(whole))


def _place(element: Element, layout: Layout) -> None:
    element.set("pos", numbers(layout.position))
    element.set("quat", _quaternion(layout.rotation))


def _add_inertia(element: Element, body: OsimBody) -> None:
    xx, yy, zz, xy, xz, yz = body.inertia
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if body.mass < _LEAST_MASS or np.linalg.eigvalsh(matrix)[0] < _LEAST_INERTIA:
        SubElement(element, "inertial", pos=numbers(body.centre),
                   mass=numbers([max(body.mass, _LEAST_MASS)]),
                   diaginertia=numbers([_LEAST_INERTIA] * 3))  # fmt: skip
        return
    SubElement(element, "inertial", pos=numbers(body.centre), mass=numbers([body.mass]),
               fullinertia=numbers(body.inertia))  # fmt: skip


def _quaternion(rotation: Rotation) -> str:
    return numbers(rotation.as_quat(scalar_first=True))
