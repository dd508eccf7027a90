"""What an accelerometer says about tilt while its board does not accelerate."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3

# A specific force this much smaller than gravity on earth has no direction [m/s^2].
_NOTHING = 1e-3


def tilt_error(
    R_world_sensor: Float[Array, "*b 3 3"], force: Float[Array, "*b 3"], up: Float[Array, "3"]
) -> Float[Array, "*b 3"]:
    """How far what a still board feels points away from up: sine of the tilt, about its axis.

    A turn by the negative of it (a world-frame rotation vector, for small tilts) brings the two
    together. Turns about the vertical change nothing, nor does the size of the force: a wrong scale
    is no tilt.

    Args:
        R_world_sensor: of the sensor.
        force: specific force, in the sensor frame [m/s^2].
        up: unit vector against gravity, world frame.
    """
    return so3.cross(jnp.broadcast_to(up, force.shape), direction(R_world_sensor, force))


def direction(
    R_world_sensor: Float[Array, "*b 3 3"], force: Float[Array, "*b 3"]
) -> Float[Array, "*b 3"]:
    """Unit vector of a specific force in the world; zero where there is none."""
    return so3.matvec3(R_world_sensor, force) / size(force)[..., None]


def size(force: Float[Array, "*b 3"]) -> Float[Array, "*b"]:
    """Norm of a specific force [m/s^2], 1 where there is none: safe to divide and derive by."""
    squared = (force * force).sum(-1)
    known = squared > _NOTHING**2
    return jnp.where(known, jnp.sqrt(jnp.where(known, squared, 1.0)), 1.0)
