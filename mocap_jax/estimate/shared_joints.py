"""Joints that sensors see only together."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

from mocap_jax.body import Body, site_segments


def shared_joints(body: Body, sites: tuple[int, ...]) -> Bool[np.ndarray, "nv"]:
    """Degrees of freedom between two boards that are more than three in all.

    The boards see the rotation of the whole chain; how its joints share it is left to the priors.

    Args:
        body: the body.
        sites: sites of the boards.
    """
    topology = body.topology
    carriers = {int(b) for b in site_segments(topology)[list(sites)]}
    dof_body = np.asarray(topology.joint_body, int)[topology.dof_joint]
    mask = np.zeros(body.nv, bool)
    for carrier in carriers:
        between, at = [carrier], topology.body_parent[carrier]
        while at > 0 and at not in carriers:
            between.append(at)
            at = topology.body_parent[at]
        dofs = np.isin(dof_body, between)
        mask |= dofs & (dofs.sum() > 3) & (at > 0)
    return mask
