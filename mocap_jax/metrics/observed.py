"""Which joints a set of sensors observes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_jax.body import Body, Topology
from mocap_jax.body.topology import DOF_WIDTH
from mocap_jax.solution.poses import joint_segments

_MOST_DOF = 3


def observed_segments(body: Body, sensor_sites: Sequence[int | str]) -> tuple[str, ...]:
    """Child segments of the joints that sensors on the body observe.

    A joint is observed when

    - its child and its parent segment both carry a used sensor, or
    - it lies on the chain of joints between two segments that carry one, no other segment on the
      chain carries one, and the joints of the chain have three degrees of freedom or fewer in
      all: then the relative orientation of the two determines them. The chain is the path in the
      tree; it may run through a common ancestor, but not through the world.

    Bodies welded to their parent belong to the parent's segment: they add no degree of freedom,
    and a sensor on one is a sensor on the parent. Free joints are not observed in this sense.

    Args:
        body: the body.
        sensor_sites: names or indices of the sites that carry a used sensor.

    Returns:
        Names of the child segments, in the body's order.

    Raises:
        InputError: a name is not a site of the body.
    """
    topology = body.topology
    sites = [topology.site_index(s) if isinstance(s, str) else int(s) for s in sensor_sites]
    segment = _rigid_segment(topology)
    carriers = sorted({segment[topology.site_body[s]] for s in sites} - {0})
    dof = np.zeros(topology.nbody, int)
    for joint, b in enumerate(topology.joint_body):
        dof[b] += DOF_WIDTH[topology.joint_types[joint]]
    observed: set[int] = set()
    for i, first in enumerate(carriers):
        for second in carriers[:i]:
            joints, inside = _path(topology, segment, first, second)
            if joints is None or inside & set(carriers):
                continue
            direct = len(joints) == 1
            if direct or sum(dof[b] for b in joints) <= _MOST_DOF:
                observed |= joints
    return tuple(topology.body_names[b] for b in joint_segments(topology) if b in observed)


def _rigid_segment(topology: Topology) -> list[int]:
    """For every body, the body that leads the rigid group it is welded to."""
    leader = list(range(topology.nbody))
    jointed = set(topology.joint_body)
    for b in range(1, topology.nbody):
        if b not in jointed:
            leader[b] = leader[topology.body_parent[b]]
    return leader


def _chain_to_world(topology: Topology, segment: list[int], start: int) -> list[int]:
    chain = [start]
    while chain[-1] != 0:
        chain.append(segment[topology.body_parent[chain[-1]]])
    return chain


def _path(
    topology: Topology, segment: list[int], first: int, second: int
) -> tuple[set[int] | None, set[int]]:
    """Segments whose joints lie between two segments, and the segments strictly in between.

    The first is None where the only path runs through the world.
    """
    up_first = _chain_to_world(topology, segment, first)
    up_second = _chain_to_world(topology, segment, second)
    common = next(b for b in up_first if b in up_second)
    if common == 0:
        return None, set()
    joints = set(up_first[: up_first.index(common)]) | set(up_second[: up_second.index(common)])
    return joints, (joints | {common}) - {first, second}
