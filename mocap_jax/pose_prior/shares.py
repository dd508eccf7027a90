"""Joints of the trunk and neck that a pose prior knows only together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Topology

Pair = tuple[int, int]


def sharing_joints(topology: Topology, known: Sequence[Pair]) -> tuple[tuple[Pair, ...], ...]:
    """Chains of joints between neighbouring segments of the prior, from the pelvis to the head.

    Args:
        topology: of the body.
        known: child and parent (bodies) of the prior's joints.

    Returns:
        For each chain of two joints or more the pairs (child, parent), from the pelvis outwards.
    """
    nodes = {b for pair in known for b in pair}
    moving = set(topology.joint_body)
    spine = _spine(topology)
    chains: list[list[Pair]] = [[]]
    above = spine[0] if spine else 0
    for b in spine[1:]:
        if b in moving:
            chains[-1].append((b, above))
            above = b
        if b in nodes:
            above = b
            chains.append([])
    # After the last node nothing holds the chain's end.
    return tuple(tuple(chain) for chain in chains[:-1] if len(chain) > 1)


def _spine(topology: Topology) -> list[int]:
    """Bodies from the pelvis to the head; empty where either is missing."""
    names = topology.body_names
    if not {"Pelvis", "Head"} <= set(names):
        return []
    chain = [names.index("Head")]
    while chain[-1] not in (0, names.index("Pelvis")):
        chain.append(topology.body_parent[chain[-1]])
    return chain[::-1] if chain[-1] else []


def unevenness(count: int, sigma: float) -> Float[np.ndarray, "3n 3n"]:
    """Whitening of n rotation vectors laid end to end: their differences from their mean."""
    apart = np.eye(count) - 1 / count
    return np.kron(apart, np.eye(3)) / sigma
