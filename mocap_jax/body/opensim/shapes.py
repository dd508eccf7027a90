"""Capsules along the segments of an OpenSim model, for pictures (its meshes are other files)."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.opensim.model import GROUND, OsimJoint, OsimModel

_DENSITY = 1000.0
_THINNEST, _THICKEST = 0.012, 0.11
_SHORTEST = 0.02


def add_shapes(elements: dict[str, Element], model: OsimModel, joints: list[OsimJoint]) -> None:
    """A capsule from each body's joint to the joints on it, or on through its centre of mass.

    Its radius gives the capsules the body's volume, at the density of water.
    """
    for joint in joints:
        name, start = joint.child.body, joint.child.position
        body = model.bodies[name]
        ends = [j.parent.position for j in joints if j.parent.body == name]
        ends.append(2.0 * body.centre - start)
        bones = [(start, e) for e in ends if np.linalg.norm(e - start) > _SHORTEST]
        length = sum(float(np.linalg.norm(e - s)) for s, e in bones)
        if not bones or name == GROUND:
            continue
        radius = np.sqrt(max(body.mass, 0.0) / (_DENSITY * np.pi * length))
        radius = float(np.clip(radius, _THINNEST, _THICKEST))
        for i, (s, e) in enumerate(bones):
            SubElement(
                elements[name], "geom", name=f"{name}/{i}", size=repr(radius),
                fromto=numbers((*s, *e)),
            )  # fmt: skip
