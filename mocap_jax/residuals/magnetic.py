"""What a magnetometer says about heading."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3

# A field this much weaker than horizontal ones on earth has no direction [T].
_NOTHING = 1e-9


def magnetic_heading_error(
    R_world_sensor: Float[Array, "*b 3 3"], reading: Float[Array, "*b 3"], north: float | Array
) -> Float[Array, "*b"]:
    """Angle about the vertical from magnetic north to where the reading has it [rad].

    Only the horizontal direction counts: strength and inclination are disturbed most indoors.
    Zero where the reading has no horizontal part.

    Args:
        R_world_sensor: of the sensor.
        reading: in the sensor frame [T].
        north: direction of magnetic north in the world, from X about Z [rad].
    """
    there = so3.matvec3(R_world_sensor, reading)
    known = (there[..., :2] ** 2).sum(-1) > _NOTHING**2
    x, y = jnp.where(known, there[..., 0], 1.0), jnp.where(known, there[..., 1], 0.0)
    c, s = jnp.cos(north), jnp.sin(north)
    angle = jnp.arctan2(c * y - s * x, c * x + s * y)
    return jnp.where(known, angle, 0.0)
