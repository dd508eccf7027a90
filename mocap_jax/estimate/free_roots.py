"""`free_roots`: the roots of the people in a body, and what says where each of them is.

The room is known: anchors stand in it. Ranges tell places from known ones, and from one person to
the next: who hears somebody that hears an anchor has a place in the room too. People whom nothing
ties to the room have places relative to the first of them, whose own is that of the declared pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.sparse.csgraph import connected_components

from mocap_jax.body import Topology
from mocap_jax.measurement import FrameData

_WORLD = 0
# Ranges of confidence 1 that it takes to tie, or more of less. A suit has as many within a second;
# echoes and strays are few and faint, and must not untie a declared place.
_LEAST_WEIGHT = 10.0


@dataclass(frozen=True)
class FreeRoot:
    """The root of one person."""

    name: str
    """Its segment."""
    first_q: int
    """Of its seven coordinates in q."""
    first_v: int
    """Of its six degrees of freedom in v."""
    tie: Literal["measured", "anchors", "person", "none"]
    """What says where it is: a measurement of it, ranges that lead to anchors, ranges that lead to
    an earlier person, or nothing (the declared pose stands in)."""
    person: str = ""
    """That person's root segment."""

    @property
    def by_ranges(self) -> bool:
        """Whether ranges say where it is, and the declared place is a guess."""
        return self.tie in ("anchors", "person")


def free_roots(data: FrameData, topology: Topology, *, root_given: bool) -> tuple[FreeRoot, ...]:
    """Every free root of a body, in the order of its joints.

    Args:
        data: measurements on the frame grid; ranges tie two bodies whose confidences add up to 10.
        topology: of the body.
        root_given: the first root was measured.
    """
    bodies = [topology.joint_body[j] for j in topology.free_joints]
    groups = _groups(data, topology)
    out: list[FreeRoot] = []
    for j, body in zip(topology.free_joints, bodies, strict=True):
        earlier = next((b for b in bodies[: len(out)] if groups[b] == groups[body]), None)
        tie: Literal["measured", "anchors", "person", "none"] = "none"
        if root_given and not out:
            tie = "measured"
        elif groups[body] == groups[_WORLD]:
            tie = "anchors"
        elif earlier is not None:
            tie = "person"
        person = topology.body_names[earlier] if earlier is not None and tie == "person" else ""
        first_q, first_v = int(topology.joint_qpos[j]), int(topology.joint_dof[j])
        out.append(FreeRoot(topology.body_names[body], first_q, first_v, tie, person))
    return tuple(out)


def _groups(data: FrameData, topology: Topology) -> np.ndarray:
    """Label (nbody,) of who hears whom: trees with ranges enough between them have the same."""
    tree, n = _trees(topology), topology.nbody
    weight = np.asarray(data.range_weight)
    heard = weight > 0
    carrier = np.array(topology.site_body, int)
    ends = [tree[carrier[np.asarray(s)[heard]]] for s in (data.range_source, data.range_receiver)]
    pair = ends[0] * n + ends[1]
    between = np.bincount(pair, weights=weight[heard], minlength=n * n).reshape(n, n)
    # Either of the two may be the one that hears.
    tied = between + between.T >= _LEAST_WEIGHT
    return connected_components(tied, directed=False)[1][tree]


def _trees(topology: Topology) -> np.ndarray:
    """The body on the world that each one (nbody,) hangs from; the world is its own."""
    out = np.arange(topology.nbody)
    for b in range(1, topology.nbody):
        parent = topology.body_parent[b]
        out[b] = b if parent == _WORLD else out[parent]
    return out
