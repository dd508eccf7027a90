"""Bodies whose sites may move a little on their segments."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from mocap_jax.body.model import Body
from mocap_jax.body.topology import SLIDE, Topology

_PREFIX = "skin/"


def with_floating_sites(body: Body, sites: Sequence[int]) -> Body:
    """Put three slides between some sites and the segments that carry them.

    The slides' coordinates, displacements along the site's axes [m], follow those of the body in
    q and v, three for each site in the order given. The new body keeps the MJCF of the old one,
    which knows nothing of the slides.

    Args:
        body: any body.
        sites: indices of the sites to loosen.
    """
    chosen, topology = np.array(sites, int), body.topology
    names = [f"{_PREFIX}{topology.site_names[s]}" for s in chosen]
    first = topology.nbody
    site_body = np.array(topology.site_body, int)
    carriers = site_body[chosen]
    site_body[chosen] = first + np.arange(len(chosen))
    looser = dataclasses.replace(
        topology,
        body_names=(*topology.body_names, *names),
        body_parent=(*topology.body_parent, *(int(b) for b in carriers)),
        joint_names=(*topology.joint_names, *(f"{n}/{axis}" for n in names for axis in "xyz")),
        joint_types=(*topology.joint_types, *[SLIDE] * (3 * len(names))),
        joint_body=(*topology.joint_body, *(first + i // 3 for i in range(3 * len(names)))),
        site_body=tuple(int(b) for b in site_body),
    )
    n = len(chosen)
    append = lambda old, new: jnp.concatenate([old, jnp.asarray(new, old.dtype)])  # noqa: E731
    return dataclasses.replace(
        body,
        topology=looser,
        body_pos=append(body.body_pos, body.site_pos[chosen]),
        body_quat=append(body.body_quat, body.site_quat[chosen]),
        joint_pos=append(body.joint_pos, np.zeros((3 * n, 3))),
        joint_axis=append(body.joint_axis, np.tile(np.eye(3), (n, 1))),
        joint_range=append(body.joint_range, np.tile([-np.inf, np.inf], (3 * n, 1))),
        qpos0=append(body.qpos0, np.zeros(3 * n)),
        site_pos=body.site_pos.at[chosen].set(0.0),
        site_quat=body.site_quat.at[chosen].set(jnp.array([1.0, 0.0, 0.0, 0.0])),
    )


def floating_dofs(body: Body) -> np.ndarray:
    """Indices in v of the displacements of floating sites."""
    return _floating(body.topology)


def joint_dofs(topology: Topology) -> np.ndarray:
    """Indices in v of the body's joints: neither roots nor displacements of floating sites."""
    return np.setdiff1d(np.flatnonzero(~topology.root_dofs), _floating(topology))


def _floating(topology: Topology) -> np.ndarray:
    chosen = [n.startswith(_PREFIX) for n in topology.joint_names]
    return topology.joint_dof[np.array(chosen, bool)] if any(chosen) else np.zeros(0, int)


def site_segments(topology: Topology) -> np.ndarray:
    """Body that carries each site (nsite,), also where the site floats on it."""
    carriers = np.array(topology.site_body, int)
    floats = np.array([topology.body_names[b].startswith(_PREFIX) for b in carriers], bool)
    return np.where(floats, np.array(topology.body_parent, int)[carriers], carriers)
