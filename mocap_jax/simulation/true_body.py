"""The true body: what the subject's segments and the worn devices really are like."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, load_body
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.motion import TIP_PREFIX
from mocap_jax.simulation.mounting import body_elements
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.suit import Suit

Parameters = dict[str, np.ndarray]


def true_body(nominal: Body, suit: Suit, profile: Profile, seed: int) -> tuple[Body, Parameters]:
    """Scale segments and shift devices as the profile says.

    Returns:
        The true body (the nominal one if nothing differs) and the true parameters:
        `segment_scale/<segment>`, and per device `mounting_rotation/<site>` (rotation vector with
        R_segment_true = R_segment_nominal exp(r) [rad]) and `mounting_position/<site>` (added to
        the scaled position, in the segment's frame [m]). `anchor_position/<site>` is what an
        anchor's true position differs from the stated one by [m].
    """
    lengths = stream(seed, "segment_length")
    names = nominal.topology.body_names[1:]
    pairs = {n: _without_side(n) for n in names}
    factor_of = {
        p: 1.0 + profile.segment_length * float(np.clip(lengths.standard_normal(), -2.5, 2.5))
        for p in dict.fromkeys(pairs.values())
    }
    scale = {n: factor_of[p] for n, p in pairs.items()}
    parameters: Parameters = {f"segment_scale/{n}": np.array(f) for n, f in scale.items()}
    tree = ElementTree.fromstring(nominal.xml)
    elements = body_elements(tree)
    for name, element in elements.items():
        _scale_segment(element, scale[name])
    for numeric in tree.iter("numeric"):
        name = (numeric.get("name") or "").removeprefix(TIP_PREFIX)
        _scale_attribute(numeric, "data", scale.get(name, 1.0))
    sites = {e.get("name"): e for e in tree.iter("site")}
    for anchor in suit.anchors:
        shift = profile.anchor_position * stream(seed, f"survey/{anchor.site}").standard_normal(3)
        sites[anchor.site].set("pos", numbers(np.array(anchor.position) + shift))
        parameters[f"anchor_position/{anchor.site}"] = shift
    for site in suit.worn_sites:
        turn, shift = _misplace(site, sites[site], profile, seed)
        parameters[f"mounting_rotation/{site}"] = turn
        parameters[f"mounting_position/{site}"] = shift
    unchanged = not (
        profile.segment_length or profile.mounting_rotation or profile.mounting_slide
        or profile.mounting_depth or (suit.anchors and profile.anchor_position)
    )  # fmt: skip
    if unchanged:
        return nominal, parameters
    return load_body(ElementTree.tostring(tree, encoding="unicode")), parameters


def _without_side(segment: str) -> str:
    """What both sides of one person share: `a/UpperLeg` of `a/LeftUpperLeg`."""
    owner, slash, name = segment.rpartition("/")
    return owner + slash + name.removeprefix("Left").removeprefix("Right")


def _scale_segment(element: ElementTree.Element, factor: float) -> None:
    """Scale everything fixed to one segment about its origin: joints, shapes, sites, children."""
    for child in element:
        if child.tag in ("body", "geom", "site", "joint", "inertial"):
            _scale_attribute(child, "pos", factor)
        if child.tag == "geom" and child.get("type") not in ("mesh", "plane", "hfield"):
            _scale_attribute(child, "fromto", factor)
            _scale_attribute(child, "size", factor)
        if child.tag == "inertial":  # of the same mass, spread further
            _scale_attribute(child, "diaginertia", factor**2)
            _scale_attribute(child, "fullinertia", factor**2)


def _scale_attribute(element: ElementTree.Element, name: str, factor: float) -> None:
    if (text := element.get(name)) is not None:
        element.set(name, numbers(factor * float(x) for x in text.split()))


def _misplace(
    name: str, site: ElementTree.Element, profile: Profile, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Shift and turn one device; sources are only shifted (their axis is not critical)."""
    rng = stream(seed, f"mounting/{name}")
    turn = profile.mounting_rotation * rng.standard_normal(3)
    local = rng.standard_normal(3) * [
        profile.mounting_slide, profile.mounting_slide, profile.mounting_depth,
    ]  # fmt: skip
    if name.startswith(SOURCE_PREFIX):
        turn = np.zeros(3)
    quat = [float(x) for x in site.get("quat", "1 0 0 0").split()]
    R_segment_device = Rotation.from_quat(quat, scalar_first=True)
    shift = R_segment_device.apply(local)
    position = np.array([float(x) for x in site.get("pos", "0 0 0").split()]) + shift
    turned = (R_segment_device * Rotation.from_rotvec(turn)).as_quat(scalar_first=True)
    site.set("pos", numbers(position))
    site.set("quat", numbers(turned))
    return turn, shift
