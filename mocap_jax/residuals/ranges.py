"""Ultrasonic range residual: source at emission, receiver at arrival."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3


def range_residual(
    source: Float[Array, "2 3"],
    receiver: Float[Array, "2 3"],
    distance: Float[Array, ""],
    lead: Float[Array, ""],
    flight: Float[Array, ""],
) -> Float[Array, ""]:
    """Predicted less measured distance [m].

    Positions between two frames are interpolated linearly; the flight time moves the receiver
    by `flight` steps at the speed of that interval (|p_mic(t + tau) - p_source(t)| = c tau).

    Args:
        source: world positions at frames k-1 and k [m].
        receiver: world positions at frames k-1 and k [m].
        distance: measured [m].
        lead: emission is `lead` steps before frame k.
        flight: time of flight in steps.
    """
    emitted = lead * source[0] + (1 - lead) * source[1]
    late = lead - flight
    arrived = late * receiver[0] + (1 - late) * receiver[1]
    return jnp.sqrt(((arrived - emitted) ** 2).sum()) - distance


def faces_receiver(
    source_rotation: Float[Array, "*b 3 3"],
    source_position: Float[Array, "*b 3"],
    receiver_position: Float[Array, "*b 3"],
) -> Float[Array, "*b"]:
    """The gate w_a of Vlasic 2007, section 4.1: 1 where the receiver is in front of the source.

    Args:
        source_rotation: R_world_source; its z axis is the emission axis.
        source_position: [m].
        receiver_position: [m].
    """
    axis = source_rotation[..., :, 2]
    return jnp.where((axis * (receiver_position - source_position)).sum(-1) > 0, 1.0, 0.0)


def point_wrench(point: Float[Array, "*b 3"], direction: Float[Array, "*b 3"]) -> Array:
    """Row (linear, angular) that maps a twist to the speed of a point along a direction."""
    return jnp.concatenate([direction, so3.cross(point, direction)], axis=-1)
