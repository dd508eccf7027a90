"""Reading `.osim` documents: the layout of OpenSim 4 (40000) and that of OpenSim 3 (30000)."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body.opensim.elements import (
    numbers_of,
    objects_of,
    parse_document,
    switch_of,
    text_of,
)
from mocap_jax.body.opensim.functions import function_of
from mocap_jax.body.opensim.joints import JOINT_KINDS, axes_of, coordinates_of
from mocap_jax.body.opensim.model import (
    GROUND,
    Coupler,
    OsimBody,
    OsimJoint,
    OsimModel,
    Placement,
)
from mocap_jax.errors import InputError

_COUPLER = "CoordinateCouplerConstraint"
_OLD_INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")


def read_osim(text: str, name: str) -> OsimModel:
    """Read a model's bodies, joints and couplers; muscles, geometry and the like are left out.

    Args:
        text: the document.
        name: of the file, for messages.

    Raises:
        InputError: what is wrong, or which feature is not represented, and where.
    """
    model = parse_document(text, name).find("Model")
    if model is None:
        raise InputError(f"{name}: the document holds no <Model>")
    elements = [e for e in objects_of(model, "BodySet") if text_of(e, "mass") or e.tag == "Body"]
    old = any(e.find("Joint") is not None for e in elements)
    bodies = {
        e.get("name", ""): _body(e, f"{name}: body '{e.get('name')}'")
        for e in elements
        if e.get("name") != GROUND
    }
    if not bodies:
        raise InputError(f"{name}: the model has no bodies")
    joints = _old_joints(elements, name) if old else _joints(model, bodies, name)
    return OsimModel(
        name=model.get("name") or "opensim",
        gravity=numbers_of(model, "gravity", name, 3, default="0 -9.80665 0"),
        bodies=bodies,
        joints=tuple(joints),
        couplers=_couplers(model, name),
    )


def _body(element: Element, where: str) -> OsimBody:
    if element.find("inertia") is not None:
        inertia = numbers_of(element, "inertia", where, 6)
    else:
        inertia = np.array(
            [numbers_of(element, f"inertia_{k}", where, 1, "0")[0] for k in _OLD_INERTIA]
        )
    name = element.get("name", "")
    frames = tuple(
        (e.get("name", ""), _offset(e, name, where))
        for e in element.iterfind("components/PhysicalOffsetFrame")
    )
    return OsimBody(
        name,
        float(numbers_of(element, "mass", where, 1, "0")[0]),
        numbers_of(element, "mass_center", where, 3, "0 0 0"),
        inertia,
        frames,
    )


def _placement(body: str, orientation: np.ndarray, position: np.ndarray) -> Placement:
    """Frame on a body; OpenSim's orientations are body-fixed X-Y-Z angles."""
    return Placement(body, Rotation.from_euler("XYZ", orientation), position)


def _offset(element: Element, body: str, where: str) -> Placement:
    where = f"{where}, frame '{element.get('name')}'"
    return _placement(
        body,
        numbers_of(element, "orientation", where, 3, "0 0 0"),
        numbers_of(element, "translation", where, 3, "0 0 0"),
    )


def _joints(model: Element, bodies: dict[str, OsimBody], name: str) -> list[OsimJoint]:
    """Joints of the layout of OpenSim 4: sockets that name frames."""
    elements = objects_of(model, "JointSet")
    out = []
    for element in elements:
        where = f"{name}: joint '{element.get('name')}'"
        parent, child = (
            _socket(element, f"socket_{side}_frame", bodies, where) for side in ("parent", "child")
        )
        out.append(_joint(element, parent, child, where))
    return out


def _socket(joint: Element, tag: str, bodies: dict[str, OsimBody], where: str) -> Placement:
    """The frame that a joint is attached to: a body, or a frame at an offset from one."""
    path = text_of(joint, tag)
    if not path:
        raise InputError(
            f"{where}: no <{tag}>; models of versions between 3.3 and 4.0 must be opened and saved "
            "in OpenSim 4"
        )
    own = {e.get("name", ""): e for e in joint.iterfind("frames/PhysicalOffsetFrame")}
    on_bodies = {n: p for body in bodies.values() for n, p in body.frames}
    return _resolved(path.rsplit("/", 1)[-1], own, on_bodies, bodies, where)


def _resolved(
    name: str, own: dict[str, Element], on_bodies: dict[str, Placement],
    bodies: dict[str, OsimBody], where: str,
) -> Placement:  # fmt: skip
    if name in own:
        # Taken out, so that a frame that is attached to itself is not followed for ever.
        element = own[name]
        others = {n: e for n, e in own.items() if n != name}
        base_name = text_of(element, "socket_parent").rsplit("/", 1)[-1]
        base = _resolved(base_name, others, on_bodies, bodies, where)
        offset = _offset(element, base.body, where)
        return Placement(
            base.body,
            base.rotation * offset.rotation,
            base.position + base.rotation.apply(offset.position),
        )
    if name in on_bodies:
        return on_bodies[name]
    if name in bodies or name == GROUND:
        return _placement(name, np.zeros(3), np.zeros(3))
    raise InputError(f"{where}: there is no frame '{name}'; valid bodies: {', '.join(bodies)}")


def _old_joints(elements: list[Element], name: str) -> list[OsimJoint]:
    """Joints of the layout of OpenSim 3: each body holds the joint to its parent."""
    out = []
    for body in elements:
        holder = body.find("Joint")
        for joint in holder if holder is not None else ():
            where = f"{name}: joint '{joint.get('name')}'"
            if switch_of(joint, "reverse"):
                raise InputError(f"{where}: reversed joints are not supported")
            parent, child = (
                _placement(
                    on,
                    numbers_of(joint, orientation, where, 3, "0 0 0"),
                    numbers_of(joint, location, where, 3, "0 0 0"),
                )
                for on, orientation, location in (
                    (text_of(joint, "parent_body"), "orientation_in_parent", "location_in_parent"),
                    (body.get("name", ""), "orientation", "location"),
                )
            )
            out.append(_joint(joint, parent, child, where))
    return out


def _joint(element: Element, parent: Placement, child: Placement, where: str) -> OsimJoint:
    if element.tag not in JOINT_KINDS:
        raise InputError(
            f"{where}: {element.tag} is not supported; valid: {', '.join(JOINT_KINDS)}"
        )
    coordinates = coordinates_of(element, where)
    rotations, translations = axes_of(element, coordinates, where)
    return OsimJoint(
        element.get("name", ""), element.tag, parent, child, coordinates, rotations, translations
    )


def _couplers(model: Element, name: str) -> tuple[Coupler, ...]:
    """Coordinate couplers; any other enforced constraint is refused."""
    out = []
    for element in objects_of(model, "ConstraintSet"):
        where = f"{name}: constraint '{element.get('name')}'"
        disabled = switch_of(element, "isDisabled")
        if disabled or not switch_of(element, "isEnforced", default=True):
            continue
        if element.tag != _COUPLER:
            raise InputError(
                f"{where}: {element.tag} is not supported; valid: {_COUPLER} (or isEnforced false)"
            )
        independent = text_of(element, "independent_coordinate_names").split()
        if len(independent) != 1:
            raise InputError(f"{where}: it must follow one coordinate, not {len(independent)}")
        holder = element.find("coupled_coordinates_function")
        if holder is None:
            raise InputError(f"{where}: no <coupled_coordinates_function>")
        scale = float(numbers_of(element, "scale_factor", where, 1, "1")[0])
        out.append(
            Coupler(
                text_of(element, "dependent_coordinate_name"),
                independent[0],
                function_of(holder, where).scaled(scale),
            )
        )
    return tuple(out)
