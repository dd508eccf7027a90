"""h(x): what sensors read at a pose, velocity and acceleration, with exact derivatives.

Jacobians are with respect to (dq, dv, da) in the tangent space, columns in this order; those of
readings that do not depend on a, or on v and a, leave these columns out.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float, Int

from mocap_jax import so3
from mocap_jax.body import Body, frames
from mocap_jax.measurement.chain import (
    Chain,
    Screw,
    SiteState,
    bodies_of,
    screw_cross,
    site_mask,
    site_state,
)

Sites = tuple[int, ...]


class Prediction(NamedTuple):
    """Predicted readings and their Jacobian."""

    value: Float[Array, "*m"]
    jacobian: Float[Array, "*m c"]


def orientation(body: Body, c: Chain, sites: Sites) -> Prediction:
    """Rotation sensor to world (s, 3, 3); Jacobian (s, 3, nv) of its change in the sensor frame."""
    R = c.site_rotation[jnp.asarray(sites)]
    return Prediction(R, _to_sensor(R, site_mask(body, sites) * c.screw.angular))


def rate(body: Body, c: Chain, sites: Sites) -> Prediction:
    """Angular velocity in the sensor frame [rad/s] (Vlasic 2007, eq. 3); columns (dq, dv)."""
    s, mask = site_state(body, c, sites), site_mask(body, sites)
    by_q = mask * so3.cross(c.base_twist.angular, c.screw.angular)
    by_v = mask * c.screw.angular
    jacobian = jnp.concatenate([_to_sensor(s.rotation, by_q), _to_sensor(s.rotation, by_v)], -1)
    return Prediction(so3.matvec3(jnp.swapaxes(s.rotation, -1, -2), s.rate), jacobian)


def specific_force(body: Body, c: Chain, sites: Sites) -> Prediction:
    """Acceleration minus gravity in the sensor frame [m/s^2] (Vlasic 2007, eq. 2)."""
    s, mask = site_state(body, c, sites), site_mask(body, sites)
    on = bodies_of(body, sites)
    # Gravity is an acceleration of the base, the same in all frames.
    base = Screw(c.base_acceleration.angular, c.base_acceleration.linear - body.gravity)
    relative = Screw(
        c.body_twist.angular[on][:, None] - c.base_twist.angular,
        c.body_twist.linear[on][:, None] - c.base_twist.linear,
    )
    twist_q, acceleration_q = screw_cross(c.base_twist, c.screw), screw_cross(base, c.screw)
    by_q = _point(s, twist_q, _plus(acceleration_q, screw_cross(_rows(twist_q), relative)))
    by_v = _point(s, c.screw, _plus(c.screw_rate, screw_cross(_rows(c.screw), relative)))
    by_a = _lever(s, c.screw)
    jacobian = jnp.concatenate([_to_sensor(s.rotation, mask * x) for x in (by_q, by_v, by_a)], -1)
    force = so3.matvec3(jnp.swapaxes(s.rotation, -1, -2), s.acceleration - body.gravity)
    return Prediction(force, jacobian)


def magnetic_field(body: Body, c: Chain, sites: Sites, field: Float[Array, "3"]) -> Prediction:
    """A uniform world field in the sensor frames, R' B [T]; Jacobian (s, 3, nv).

    A sensor turned by d, in its own frame, sees B turned by -d.
    """
    turned = orientation(body, c, sites)
    seen = so3.matvec3(jnp.swapaxes(turned.value, -1, -2), jnp.broadcast_to(field, (len(sites), 3)))
    by_q = so3.cross(seen[:, None], jnp.swapaxes(turned.jacobian, -1, -2))
    return Prediction(seen, jnp.swapaxes(by_q, -1, -2))


class Ranging(NamedTuple):
    """Predicted distances, Jacobian, and the cosine between emission axis and direction."""

    value: Float[Array, "k"]
    jacobian: Float[Array, "k 3*nv"]
    cosine: Float[Array, "k"]
    """Of the angle between the source's axis and the receiver; w_a is 0 where it is negative
    (Vlasic 2007, section 4.1)."""


def distance(
    body: Body,
    c: Chain,
    sites: Sites,
    source: Int[Array, "k"],
    receiver: Int[Array, "k"],
    lead: Float[Array, "k"],
    travel: Float[Array, "k"],
) -> Ranging:
    """Distance from sources at emission to receivers at arrival [m] (Vlasic 2007, eq. 4).

    Args:
        body: the body.
        c: its motion at the frame.
        sites: sites that take part.
        source, receiver: places in `sites`.
        lead: emission is this long before the frame [s].
        travel: time the sound takes (the measured distance over its speed) [s].
    """
    s, mask = site_state(body, c, sites), site_mask(body, sites)
    position_q = mask * _lever(s, c.screw)
    velocity_q = mask * _velocity_change(body, c, s, sites)
    start, end = -lead, travel - lead
    p_source, p_receiver = _extrapolate(s, source, start), _extrapolate(s, receiver, end)
    apart = p_receiver - p_source
    d = jnp.sqrt((apart * apart).sum(-1) + 1e-18)
    u = (apart / d[:, None])[:, None, :]

    along = lambda x, at: (x[at] * u).sum(-1)  # noqa: E731
    Jr, Js = along(position_q, receiver), along(position_q, source)
    t_r, t_s = end[:, None], start[:, None]
    by_q = Jr + t_r * along(velocity_q, receiver) - Js - t_s * along(velocity_q, source)
    by_v = t_r * Jr - t_s * Js
    by_a = 0.5 * (t_r**2 * Jr - t_s**2 * Js)
    axis = s.rotation[source, :, 2]
    return Ranging(d, jnp.concatenate([by_q, by_v, by_a], -1), (axis * u[:, 0]).sum(-1))


def root_pose(body: Body, q: Array) -> tuple[Array, Array, Array]:
    """Rotation (3, 3) and position [m] of the first body, and the Jacobian (6, nv).

    The first three rows are the change of position in the world frame, the last three that of
    rotation in the body frame.
    """
    f = frames(body, q)
    mask = jnp.asarray(body.topology.body_dofs[1], f.angular.dtype)[:, None]
    R, p = f.rotation[1], f.position[1]
    linear = mask * (f.linear + so3.cross(f.angular, jnp.broadcast_to(p, f.angular.shape)))
    angular = (mask * f.angular) @ R
    return R, p, jnp.concatenate([linear.T, angular.T])


def _to_sensor(R: Array, x: Array) -> Array:
    """World vectors (s, nv, 3) to sensor coordinates, as Jacobian rows (s, 3, nv)."""
    return (R[:, :, :, None] * jnp.swapaxes(x, -1, -2)[:, :, None, :]).sum(1)


def _rows(screw: Screw) -> Screw:
    return Screw(screw.angular[None], screw.linear[None])


def _plus(a: Screw, b: Screw) -> Screw:
    return Screw(a.angular + b.angular, a.linear + b.linear)


def _lever(s: SiteState, screw: Screw) -> Array:
    """Velocity of the sites per unit of each screw, (s, nv, 3)."""
    return screw.linear + so3.cross(screw.angular[None], s.position[:, None])


def _point(s: SiteState, twist: Screw, acceleration: Screw) -> Array:
    """Change of the sites' accelerations when their bodies' twists and accelerations change."""
    spin = so3.cross(twist.angular[None], s.velocity[:, None])
    return (
        acceleration.linear
        + so3.cross(acceleration.angular, s.position[:, None])
        + spin
        + so3.cross(s.rate[:, None], _lever(s, twist))
    )


def _velocity_change(body: Body, c: Chain, s: SiteState, sites: Sites) -> Array:
    """Derivative of the sites' world velocities with respect to the pose, (s, nv, 3)."""
    on = bodies_of(body, sites)
    relative = Screw(
        c.body_twist.angular[on][:, None] - c.base_twist.angular,
        c.body_twist.linear[on][:, None] - c.base_twist.linear,
    )
    change = screw_cross(_rows(c.screw), relative)
    carried = so3.cross(change.angular, s.position[:, None])
    return change.linear + carried + so3.cross(s.rate[:, None], _lever(s, c.screw))


def _extrapolate(s: SiteState, at: Array, t: Array) -> Array:
    t = t[:, None]
    return s.position[at] + t * s.velocity[at] + 0.5 * t**2 * s.acceleration[at]
