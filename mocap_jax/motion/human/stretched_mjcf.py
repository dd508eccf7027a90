"""MJCF text of a human body whose segments are stretched."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from mocap_jax.body.mjcf_text import numbers
from mocap_jax.motion.skeleton import TIP_PREFIX


def stretched_mjcf(
    xml: str, factors: Mapping[str, Float[np.ndarray, "3"]], lift: float, root: str = "Pelvis"
) -> str:
    """The text with segments stretched as `human(lengths=...)` would.

    All that is fixed to a segment moves along: child joints, capsules, sites, tips, the centre of
    mass and its spread; masses and thicknesses stay.

    Args:
        xml: MJCF of `human()`, with or without sites.
        factors: of segments along X, Y and Z of their frames; others stay.
        lift: added to the root's height [m].
        root: name of the root segment.
    """
    tree = ElementTree.fromstring(xml)
    for element in tree.iter("body"):
        factor = factors.get(element.get("name", ""))
        if factor is not None:
            _stretch_segment(element, factor)
    for numeric in tree.iter("numeric"):
        factor = factors.get((numeric.get("name") or "").removeprefix(TIP_PREFIX))
        if factor is not None:
            _multiply(numeric, "data", factor)
    for element in tree.iter("body"):
        if element.get("name") == root:
            position = _read(element, "pos") if element.get("pos") else np.zeros(3)
            element.set("pos", numbers(position + [0.0, 0.0, lift]))
    return ElementTree.tostring(tree, encoding="unicode")


def _stretch_segment(element: ElementTree.Element, factor: Float[np.ndarray, "3"]) -> None:
    for child in element:
        if child.tag in ("body", "geom", "site", "inertial", "camera", "light"):
            _multiply(child, "pos", factor)
        if child.tag == "geom":
            _multiply(child, "fromto", np.tile(factor, 2))
        if child.tag == "inertial" and child.get("diaginertia"):
            moments = _read(child, "diaginertia")
            spread = (moments.sum() / 2 - moments) * factor**2  # mass times mean square distance
            child.set("diaginertia", numbers(spread.sum() - spread))


def _multiply(element: ElementTree.Element, name: str, factor: np.ndarray) -> None:
    if element.get(name):
        element.set(name, numbers(_read(element, name) * factor))


def _read(element: ElementTree.Element, name: str) -> np.ndarray:
    return np.array([float(x) for x in element.get(name, "").split()])
