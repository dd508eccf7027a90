"""Joints of OpenSim models, all brought to turns about and shifts along axes."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np

from mocap_jax.body.opensim.elements import numbers_of, switch_of, text_of
from mocap_jax.body.opensim.functions import function_of
from mocap_jax.body.opensim.model import Coordinate, TransformAxis
from mocap_jax.body.piecewise import straight
from mocap_jax.errors import InputError

CUSTOM = "CustomJoint"
# Axes of the turns and of the shifts, one coordinate each, in their order.
_SIMPLE: dict[str, tuple[str, str]] = {
    "WeldJoint": ("", ""),
    "PinJoint": ("z", ""),
    "SliderJoint": ("", "x"),
    "UniversalJoint": ("xy", ""),
    "GimbalJoint": ("xyz", ""),
    "BallJoint": ("xyz", ""),
    "PlanarJoint": ("z", "xy"),
    "FreeJoint": ("xyz", "xyz"),
}
JOINT_KINDS = (CUSTOM, *_SIMPLE)


def coordinates_of(joint: Element, where: str) -> tuple[Coordinate, ...]:
    """Coordinates of a joint, in either layout."""
    holder = joint.find("coordinates")
    if holder is None:
        holder = joint.find("CoordinateSet/objects")
    return tuple(_coordinate(e, where) for e in (holder if holder is not None else ()))


def _coordinate(element: Element, where: str) -> Coordinate:
    name = element.get("name", "")
    where = f"{where}, coordinate '{name}'"
    if switch_of(element, "prescribed"):
        raise InputError(f"{where}: prescribed motion is not supported (set prescribed to false)")
    default = float(numbers_of(element, "default_value", where, 1, default="0")[0])
    low, high = numbers_of(element, "range", where, 2, default="-10 10")
    return Coordinate(
        name, default, (float(low), float(high)),
        switch_of(element, "clamped"), switch_of(element, "locked"),
    )  # fmt: skip


def axes_of(
    joint: Element, coordinates: tuple[Coordinate, ...], where: str
) -> tuple[tuple[TransformAxis, ...], tuple[TransformAxis, ...]]:
    """Turns and shifts of a joint.

    Raises:
        InputError: a kind of joint, or of its axes, that is not represented.
    """
    if joint.tag == CUSTOM:
        return _custom_axes(joint, {c.name for c in coordinates}, where)
    if joint.tag not in _SIMPLE:
        raise InputError(f"{where}: {joint.tag} is not supported; valid: {', '.join(JOINT_KINDS)}")
    turns, shifts = _SIMPLE[joint.tag]
    if len(coordinates) != len(turns) + len(shifts):
        raise InputError(
            f"{where}: a {joint.tag} has {len(turns) + len(shifts)} coordinates, "
            f"not {len(coordinates)}"
        )
    names = [c.name for c in coordinates]
    made = [
        TransformAxis(f"{kind}{i + 1}", np.eye(3)["xyz".index(letter)], straight(0.0, 1.0), name)
        for kind, letters, group in (
            ("rotation", turns, names[: len(turns)]),
            ("translation", shifts, names[len(turns) :]),
        )
        for i, (letter, name) in enumerate(zip(letters, group, strict=True))
    ]
    return tuple(made[: len(turns)]), tuple(made[len(turns) :])


def _custom_axes(
    joint: Element, names: set[str], where: str
) -> tuple[tuple[TransformAxis, ...], tuple[TransformAxis, ...]]:
    transform = joint.find("SpatialTransform")
    axes = [] if transform is None else transform.findall("TransformAxis")
    if len(axes) != 6:
        raise InputError(f"{where}: its SpatialTransform has {len(axes)} axes instead of six")
    found = [_axis(e, names, where) for e in axes]
    return tuple(found[:3]), tuple(found[3:])


def _axis(element: Element, names: set[str], where: str) -> TransformAxis:
    where = f"{where}, {element.get('name')}"
    axis = numbers_of(element, "axis", where, 3)
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise InputError(f"{where}: its axis has no length")
    used = text_of(element, "coordinates").split()
    if len(used) > 1:
        raise InputError(
            f"{where}: a function of several coordinates ({', '.join(used)}) is not supported; "
            "valid: of one, or none"
        )
    if used and used[0] not in names:
        raise InputError(f"{where}: its joint has no coordinate '{used[0]}'")
    function = function_of(element, where)
    if used:
        return TransformAxis(element.get("name", ""), axis / length, function, used[0])
    # Without a coordinate OpenSim evaluates the function at zero.
    constant = straight(float(function(np.zeros(()))))
    return TransformAxis(element.get("name", ""), axis / length, constant)
