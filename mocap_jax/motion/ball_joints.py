"""Bodies whose joints all turn freely, as those of statistical body models do."""

from __future__ import annotations

from xml.etree import ElementTree

from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.motion.segment_names import XSENS_SEGMENTS

_JOINTS = ("joint", "freejoint")


def ball_jointed(body: Body) -> Body:
    """The body with a ball joint in place of each segment's hinges.

    Segments with Xsens names, and those between pelvis and head, get one ball joint each where
    their first joint was (von Marcard 2017: 24 joints of three degrees of freedom). Others, fingers
    and eyes, are fixed to their parents. A root that moves about keeps its joints; others lose
    slides and limits, which the pose prior stands in for (section 4.3 of the paper).

    Args:
        body: with its MJCF text.

    Raises:
        InputError: no body between the world and its segments, or no segment that turns.
    """
    topology = body.topology
    kept = set(XSENS_SEGMENTS) | _spine(body)
    tree = ElementTree.fromstring(body.xml)
    turned, roots = 0, tree.findall("worldbody/body")
    for element in tree.iter("body"):
        joints = [e for e in element if e.tag in _JOINTS]
        if not joints or element in roots and _moves_about(joints):
            continue
        for joint in joints:
            element.remove(joint)
        if element.get("name") in kept:
            element.insert(0, _ball(str(element.get("name")), joints[0]))
            turned += 1
    if not turned:
        raise InputError(
            "ball_jointed: no segment with an Xsens name turns in this body; its segments are "
            + ", ".join(topology.body_names[1:])
        )
    _drop_references(tree)
    return load_body(ElementTree.tostring(tree, encoding="unicode"))


def _moves_about(joints: list[ElementTree.Element]) -> bool:
    return any(j.tag == "freejoint" or j.get("type") in ("free", "slide") for j in joints)


def _ball(name: str, first: ElementTree.Element) -> ElementTree.Element:
    ball = ElementTree.Element("joint", name=name, type="ball", limited="false")
    if first.get("pos"):
        ball.set("pos", str(first.get("pos")))
    return ball


def _drop_references(tree: ElementTree.Element) -> None:
    """Remove what may name joints that are gone."""
    for tag in ("actuator", "sensor", "equality", "tendon", "keyframe", "contact"):
        for element in tree.findall(tag):
            tree.remove(element)


def _spine(body: Body) -> set[str]:
    names, parent = body.topology.body_names, body.topology.body_parent
    at = names.index("Head") if "Head" in names else 0
    spine = set()
    while at:
        spine.add(names[at])
        at = parent[at]
    return spine
