"""Putting a suit on a body: named sites in the MJCF text, and shapes for bodies without any."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.site_names import ANCHOR_PREFIX, SOURCE_PREFIX
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion import xsens_name
from mocap_jax.simulation.suit import Anchor, Mounting, Suit

# Radius of a capsule made for a bare segment, as a share of its length, and its bounds [m].
_SLENDERNESS, _THINNEST, _THICKEST = 0.15, 0.02, 0.10


def mount(body: Body, suit: Suit) -> Body:
    """Body with a site for every board, source (`source/...`) and anchor (`anchor/...`).

    The MJCF text itself is edited: MuJoCo's own writer rounds numbers.

    Raises:
        InputError: a segment does not exist, or a site of that name does.
    """
    tree = ElementTree.fromstring(body.xml)
    elements = body_elements(tree)
    by_name = _segment_elements(elements)
    taken = set(body.topology.site_names)
    for device in suit.boards:
        _add_site(by_name, device, device.name, taken)
    for device in suit.sources:
        _add_site(by_name, device, SOURCE_PREFIX + device.name, taken)
    world = tree.find("worldbody")
    for anchor in suit.anchors:
        _place_site(world, anchor, anchor.site, taken)
    return load_body(ElementTree.tostring(tree, encoding="unicode"))


def standing_anchors(body: Body, sites: Iterable[str]) -> tuple[Anchor, ...]:
    """The anchors among these sites of a body: what stands in the world and is named so.

    Whether one emits, and at which frequency, a site does not tell.
    """
    found = []
    for site in sites:
        i = body.site_index(site)
        if body.topology.site_body[i] == 0 and site.startswith(ANCHOR_PREFIX):
            position, quat = np.asarray(body.site_pos)[i], np.asarray(body.site_quat)[i]
            name = site.removeprefix(ANCHOR_PREFIX)
            found.append(Anchor(name, tuple(position.tolist()), tuple(quat.tolist())))
    return tuple(found)


def with_shapes(body: Body) -> Body:
    """The body itself, or with capsules along its segments if it has no geometry at all."""
    model = body.mujoco_model()
    if (model.geom_bodyid > 0).any():
        return body
    tree = ElementTree.fromstring(body.xml)
    elements = body_elements(tree)
    parents, names = body.topology.body_parent, body.topology.body_names
    for child, parent in enumerate(parents):
        end = np.asarray(model.body_pos[child])
        length = float(np.linalg.norm(end))
        if parent == 0 or length < 1e-3:
            continue
        radius = float(np.clip(_SLENDERNESS * length, _THINNEST, _THICKEST))
        ElementTree.SubElement(
            elements[names[parent]], "geom", type="capsule", contype="0", conaffinity="0",
            fromto=numbers([0.0, 0.0, 0.0, *end]), size=numbers([radius]),
        )  # fmt: skip
    return load_body(ElementTree.tostring(tree, encoding="unicode"))


def body_elements(tree: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """The `<body>` elements of an MJCF document by name."""
    world = tree.find("worldbody")
    found = [] if world is None else world.iter("body")
    return {e.get("name", f"body{i + 1}"): e for i, e in enumerate(found)}


def _segment_elements(
    elements: dict[str, ElementTree.Element],
) -> dict[str, ElementTree.Element]:
    """Elements by their own and, where free, by their Xsens names."""
    by_name = dict(elements)
    for name, element in elements.items():
        owner, slash, own = name.rpartition("/")  # of several people
        by_name.setdefault(owner + slash + xsens_name(own), element)
    return by_name


def _add_site(
    elements: dict[str, ElementTree.Element], device: Mounting, site: str, taken: set[str]
) -> None:
    if device.segment not in elements:
        raise unknown_name(f"segment for '{site}':", device.segment, elements)
    _place_site(elements[device.segment], device, site, taken)


def _place_site(
    parent: ElementTree.Element | None, device: Mounting | Anchor, site: str, taken: set[str]
) -> None:
    if site in taken:
        raise InputError(f"site '{site}' exists already: two devices of one name, or worn twice")
    taken.add(site)
    assert parent is not None  # every model that loads has a world
    ElementTree.SubElement(
        parent, "site", name=site, pos=numbers(device.position), quat=numbers(device.orientation)
    )
