"""How far apart two places on a body can be, whatever its pose."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body.model import Body
from mocap_jax.body.topology import FREE, SLIDE


def reach(body: Body, one: int, other: int) -> float:
    """Upper bound of the distance of two sites [m]: the way along the chain of joints between them.

    Rotations about an anchor keep distances to it, so the way from anchor to anchor has the same
    length in every pose. Joints that slide have no bound: infinity. Limits of angles are not used.

    Args:
        body: the body.
        one: index of a site.
        other: index of another.
    """
    chain = _ancestors(body, one)
    common = next(b for b in _ancestors(body, other) if b in chain)
    (first, start), (second, end) = (_way_to(body, site, common) for site in (one, other))
    return first + second + float(np.linalg.norm(start - end))


def _ancestors(body: Body, site: int) -> list[int]:
    """The site's body, its parent, and so on to the world."""
    chain = [body.topology.site_body[site]]
    while chain[-1]:
        chain.append(body.topology.body_parent[chain[-1]])
    return chain


def _way_to(body: Body, site: int, ancestor: int) -> tuple[float, Float[np.ndarray, "3"]]:
    """Length of the way from a site to the last anchor below an ancestor, and that anchor in it."""
    t, here, length = body.topology, body.topology.site_body[site], 0.0
    point = np.array(body.site_pos[site], np.float64)
    while here != ancestor:
        for joint in reversed(t.joints_of_body(here)):
            if t.joint_types[joint] in (FREE, SLIDE):
                return float("inf"), point
            anchor = np.array(body.joint_pos[joint], np.float64)
            length += float(np.linalg.norm(point - anchor))
            point = anchor
        turn = Rotation.from_quat(np.array(body.body_quat[here]), scalar_first=True)
        point = np.array(body.body_pos[here]) + turn.apply(point)
        here = t.body_parent[here]
    return length, point
