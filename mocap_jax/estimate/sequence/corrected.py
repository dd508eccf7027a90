"""Readings of boards freed of the errors that are unknowns: clock, bias and scale.

A board whose stamps are late by d says at t what it felt at t - d, so what it feels at t is what it
says at t + d. The readings' own time derivatives take them there: their noise is small against the
slopes of human motion, and differences of predictions would couple twice as many frames. (Measured
orientations are noisier: there the prediction is moved, see `orientation_terms`.)
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.layout import Layout, Terms
from mocap_jax.estimate.sequence.window import Window


def forces(layout: Layout, constants: Constants, terms: Terms) -> Float[Array, "n s 3"]:
    """Specific forces [m/s^2]."""
    return unbiased(
        layout, constants, terms, in_time(layout, constants, terms.force, terms.force_slopes)
    )


def unbiased(
    layout: Layout, constants: Constants, terms: Terms, readings: Float[Array, "n s 3"]
) -> Float[Array, "n s 3"]:
    """Readings of accelerometers without bias and scale errors [m/s^2]."""
    c = constants.corrections
    bias = constants.accelerometer_bias
    if layout.accelerometer_steps:
        bias = bias + _walked(terms, c.accelerometer_walk)
    force = readings - bias
    return force / (1 + c.accelerometer_scale) if layout.use_accelerometer_scale else force


def force_rotation(layout: Layout, w: Window, terms: Terms) -> Float[Array, "n s 3 3"]:
    """R_world_sensor by which specific forces become accelerations (n, s, 3, 3).

    The measured one (von Marcard 2017, eq. 13) makes accelerations constants of their residual,
    which then depends on positions alone.
    """
    return terms.orientation if layout.measured_rotation else w.rotation


def rates(
    layout: Layout, constants: Constants, terms: Terms
) -> tuple[Float[Array, "n s 3"], Float[Array, "n-1 s 3"]]:
    """Rates at the frames, and their means over the intervals between [rad/s]."""
    c = constants.corrections
    bias = mean_bias = constants.gyroscope_bias
    if layout.gyroscope_steps:
        bias = bias + _walked(terms, c.gyroscope_walk)
        mean_bias = (bias[:-1] + bias[1:]) / 2
    rate = in_time(layout, constants, terms.rate, terms.rate_slopes) - bias
    mean = in_time(layout, constants, terms.mean_rate, terms.mean_rate_slopes)[:-1] - mean_bias
    if layout.use_gyroscope_scale:
        return rate / (1 + c.gyroscope_scale), mean / (1 + c.gyroscope_scale)
    return rate, mean


def in_time(
    layout: Layout, constants: Constants, readings: Array, slopes: tuple[Array, ...]
) -> Array:
    """Readings (n, s, 3) at the times of the frames."""
    if not layout.use_clock_offset:
        return readings
    late = jnp.asarray(constants.corrections.clock_offset)
    return readings + late * slopes[0] + late**2 / 2 * slopes[1]


def slope(constants: Constants, slopes: tuple[Array, ...]) -> Array:
    """Derivative of `in_time` by the clock offset."""
    return slopes[0] + jnp.asarray(constants.corrections.clock_offset) * slopes[1]


def _walked(terms: Terms, steps: Float[Array, "s m"]) -> Float[Array, "n s 3"]:
    """What the steps of walks add to biases in each frame."""
    basis = terms.walk[0]
    each = jnp.asarray(steps).reshape(-1, basis.shape[1], 3)
    return jnp.einsum("nj,sjp->nsp", basis, each)
