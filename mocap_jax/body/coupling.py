"""Coordinates that follow others, as the secondary rotations of a knee follow its flexion.

MJCF has no joint that turns about several axes at once by functions of one coordinate. Such a joint
is written as one hinge (or slide) for each axis; those that follow are named, with the joint they
follow and the function, in the model's custom data, where `couplings` finds them. `Body`'s own
kinematics takes all coordinates as they are: estimators have to keep them together.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from xml.etree import ElementTree

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.model import Body
from mocap_jax.body.piecewise import Piecewise

COUPLING_PREFIX = "coupling/"
"""Of the MJCF's custom texts (the joint followed) and numbers (the function)."""


@dataclass(frozen=True)
class Coupling:
    """q[joint] = function(q[leader]), for two hinges or slides."""

    joint: str
    leader: str
    function: Piecewise


def couplings(body: Body) -> tuple[Coupling, ...]:
    """Coordinates of a body that follow others, leaders first; empty for most bodies."""
    return _from_text(body.xml)


def coupled_joints(body: Body) -> frozenset[str]:
    """Names of the joints that follow others."""
    return frozenset(c.joint for c in couplings(body))


def follow(body: Body, q: Float[Array, "nq"]) -> Float[Array, "nq"]:
    """The pose with all following coordinates at their functions' values."""
    at = body.topology.joint_qpos
    for c in couplings(body):
        leader, joint = (body.topology.joint_index(name) for name in (c.leader, c.joint))
        q = jnp.asarray(q).at[at[joint]].set(c.function.at(q[at[leader]]))
    return q


def coupling_elements(coupling: Coupling) -> list[ElementTree.Element]:
    """What states a coupling in the `<custom>` section of an MJCF document."""
    f, name = coupling.function, COUPLING_PREFIX + coupling.joint
    # Numbers: of pieces, of coefficients a piece, breaks, origins, coefficients.
    data = [len(f.origins), len(f.coefficients[0]), *f.breaks, *f.origins]
    data += [c for row in f.coefficients for c in row]
    text = numbers(data)
    return [
        ElementTree.Element("text", name=name, data=coupling.leader),
        ElementTree.Element("numeric", name=name, data=text),
    ]


@lru_cache(maxsize=64)
def _from_text(xml: str) -> tuple[Coupling, ...]:
    if COUPLING_PREFIX not in xml:
        return ()
    custom = ElementTree.fromstring(xml).find("custom")
    if custom is None:
        return ()
    leaders = {e.get("name", ""): e.get("data", "") for e in custom.iter("text")}
    found = []
    for element in custom.iter("numeric"):
        name = element.get("name", "")
        if name.startswith(COUPLING_PREFIX) and name in leaders:
            numbers = [float(x) for x in element.get("data", "").split()]
            joint = name.removeprefix(COUPLING_PREFIX)
            found.append(Coupling(joint, leaders[name], _function(numbers)))
    return tuple(found)


def _function(numbers: list[float]) -> Piecewise:
    pieces, width = int(numbers[0]), int(numbers[1])
    breaks, rest = numbers[2 : 1 + pieces], numbers[1 + pieces :]
    origins, table = rest[:pieces], rest[pieces:]
    rows = tuple(tuple(table[i * width : (i + 1) * width]) for i in range(pieces))
    return Piecewise(tuple(breaks), tuple(origins), rows)
