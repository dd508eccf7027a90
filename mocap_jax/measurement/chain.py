"""Kinematics of sites at one state (q, v, a), with the ingredients of its exact derivatives.

Everything is written with screws about the world origin. Let S_k be the screw of degree of freedom
k and V_k, A_k the twist and the acceleration of the frame just *before* its joint. Turning k by d
moves all that hangs on it rigidly and keeps its motion relative to that frame. Seen from the moved
body, nothing has changed but the base, whose twist is now V_k + d (V_k x S_k) and whose
acceleration A_k + d (A_k x S_k): this gives derivatives of sensor readings with respect to the
pose without differentiating through the tree.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, Topology, frames, sites_on_frames
from mocap_jax.body.topology import FREE


class Screw(NamedTuple):
    """Angular and linear part, world frame, about the world origin."""

    angular: Float[Array, "*n 3"]
    linear: Float[Array, "*n 3"]


class Chain(NamedTuple):
    """Motion of the body at one state: screws, their rates, and the frames before the joints."""

    screw: Screw
    """Of each degree of freedom (nv)."""
    screw_rate: Screw
    base_twist: Screw
    """Of the frame before each degree of freedom's joint (nv)."""
    base_acceleration: Screw
    """Of the same frame (nv), gravity not included."""
    body_twist: Screw
    """(nbody)"""
    body_acceleration: Screw
    """(nbody)"""
    site_rotation: Float[Array, "nsite 3 3"]
    """Site to world."""
    site_position: Float[Array, "nsite 3"]


class SiteState(NamedTuple):
    """Motion of chosen sites in world coordinates (gravity not included)."""

    rotation: Float[Array, "s 3 3"]
    position: Float[Array, "s 3"]
    rate: Float[Array, "s 3"]
    rate_change: Float[Array, "s 3"]
    velocity: Float[Array, "s 3"]
    acceleration: Float[Array, "s 3"]


def screw_cross(a: Screw, b: Screw) -> Screw:
    """Rate of change of screw b when it is carried by the twist a."""
    return Screw(
        so3.cross(a.angular, b.angular),
        so3.cross(a.angular, b.linear) + so3.cross(a.linear, b.angular),
    )


def before_dofs(topology: Topology) -> np.ndarray:
    """Mask (nv, nv): row k marks the degrees of freedom that move the frame before k's joint.

    A free joint is a translation followed by a rotation.
    """
    joint = topology.dof_joint
    body = np.asarray(topology.joint_body, int)[joint]
    mask = topology.body_dofs[body] & (joint[None, :] < joint[:, None])
    for j, kind in enumerate(topology.joint_types):
        if kind == FREE:
            at = topology.joint_dof[j]
            mask[at + 3 : at + 6, at : at + 3] = True
    return mask


def chain(body: Body, q: Float[Array, "nq"], v: Float[Array, "nv"], a: Float[Array, "nv"]) -> Chain:
    """Motion of all bodies and of the frames before all joints."""
    topology = body.topology
    f = frames(body, q)
    sites = sites_on_frames(body, f)
    screw = Screw(f.angular, f.linear)
    body_mask, before = topology.body_dofs, before_dofs(topology)
    carried = _sum(topology.axis_dofs, screw, v)
    screw_rate = screw_cross(carried, screw)
    share = Screw(
        screw.angular * a[:, None] + screw_rate.angular * v[:, None],
        screw.linear * a[:, None] + screw_rate.linear * v[:, None],
    )
    one = jnp.ones_like(v)
    return Chain(
        screw,
        screw_rate,
        _sum(before, screw, v),
        _sum(before, share, one),
        _sum(body_mask, screw, v),
        _sum(body_mask, share, one),
        sites.rotation,
        sites.position,
    )


def _sum(mask: np.ndarray, screw: Screw, weight: Array) -> Screw:
    both = jnp.concatenate(
        [screw.angular * weight[:, None], screw.linear * weight[:, None]], axis=1
    )
    total = jnp.asarray(mask, weight.dtype) @ both
    return Screw(total[:, :3], total[:, 3:])


def bodies_of(body: Body, sites: tuple[int, ...]) -> np.ndarray:
    """Body that carries each site."""
    return np.asarray(body.topology.site_body, int)[np.asarray(sites, int)]


def site_mask(body: Body, sites: tuple[int, ...]) -> np.ndarray:
    """Mask (s, nv, 1): degree of freedom moves the site."""
    return body.topology.body_dofs[bodies_of(body, sites)][:, :, None]


def site_state(body: Body, c: Chain, sites: tuple[int, ...]) -> SiteState:
    """Motion of chosen sites."""
    at, on = np.asarray(sites, int), bodies_of(body, sites)
    p, w, alpha = c.site_position[at], c.body_twist.angular[on], c.body_acceleration.angular[on]
    velocity = c.body_twist.linear[on] + so3.cross(w, p)
    acceleration = c.body_acceleration.linear[on] + so3.cross(alpha, p) + so3.cross(w, velocity)
    return SiteState(c.site_rotation[at], p, w, alpha, velocity, acceleration)
