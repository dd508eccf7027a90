"""What boards with a wrong heading and a late clock would measure as their orientation."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.residuals.inertial import log_below_pi


def predicted(
    layout: Layout, rotation: Float[Array, "n s 3 3"], constants: Constants, step: Array
) -> Float[Array, "n s 3 3"]:
    """Rz(heading) R_k exp(-d w_k) of all frames; without d in the first and last.

    Args:
        layout: which errors are unknowns.
        rotation: R_world_sensor of n frames.
        constants: headings and clock offsets d.
        step: h [s].
    """
    c = constants.corrections
    if layout.use_clock_offset:
        rotation = so3.matmul3(
            rotation, so3.exp(-jnp.asarray(c.clock_offset) * spin(rotation, step))
        )
    if layout.use_heading:
        angle = jnp.asarray(c.heading)[:, 0]
        zero = jnp.zeros_like(angle)
        rotation = so3.matmul3(so3.exp(jnp.stack([zero, zero, angle], axis=-1)), rotation)
    return rotation


def spin(rotation: Float[Array, "n s 3 3"], step: Array) -> Float[Array, "n s 3"]:
    """Rates by central differences [rad/s], sensor frame; zero in the first and last frame."""
    turned = log_below_pi(so3.matmul3(jnp.swapaxes(rotation[:-2], -1, -2), rotation[2:]))
    nothing = jnp.zeros_like(turned[:1])
    return jnp.concatenate([nothing, turned / (2 * step), nothing])
