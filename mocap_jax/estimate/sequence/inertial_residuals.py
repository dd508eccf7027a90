"""Inertial residuals of a chunk and their robust losses.

The plain functions are in `residuals.inertial`; what the residuals say about poses and constants is
gathered in `inertial_terms`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.corrected import force_rotation, forces, rates
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.orientation_prediction import predicted
from mocap_jax.estimate.sequence.window import Window
from mocap_jax.residuals.inertial import log_below_pi
from mocap_jax.residuals.robust import loss, weight


class InertialResiduals(NamedTuple):
    """Residuals by centre frame, and the kinematic parts that their Jacobians reuse."""

    acceleration: Float[Array, "n-2 s 3"]
    """Centres 1 .. n - 2."""
    rate: Float[Array, "n-1 s 3"]
    """Intervals 0 .. n - 2."""
    turned: Float[Array, "n-1 s 3"]
    orientation: Float[Array, "n s 3"]


def residuals(
    layout: Layout, w: Window, constants: Constants, terms: Terms, weights: Weights, gravity: Array
) -> InertialResiduals:
    """All inertial residuals of a chunk (see `residuals.inertial` for the plain functions)."""
    h = weights.step
    force = so3.matvec3(force_rotation(layout, w, terms), forces(layout, constants, terms))
    c = layout.force_weights
    measured = c[0] * force[:-2] + c[1] * force[1:-1] + c[2] * force[2:]
    second = (w.position[:-2] - 2 * w.position[1:-1] + w.position[2:]) / h**2
    turned = log_below_pi(so3.matmul3(jnp.swapaxes(w.rotation[:-1], -1, -2), w.rotation[1:]))
    rate, mean = rates(layout, constants, terms)
    coning = so3.cross(rate[:-1], rate[1:])
    orientation = jnp.zeros_like(w.position)
    if layout.use_orientation:
        there = predicted(layout, w.rotation, constants, h)
        relative = so3.matmul3(jnp.swapaxes(terms.orientation, -1, -2), there)
        orientation = so3.log(relative)
    return InertialResiduals(
        second - measured - gravity, turned / h - mean - h / 12 * coning, turned, orientation
    )


def _squared(residual: Array, information: Array) -> Array:
    return information * (residual * residual).sum(axis=-1)


def losses(
    layout: Layout, r: InertialResiduals, terms: Terms, weights: Weights, core: slice
) -> dict[str, Float[Array, "c s"]]:
    """Robust squared whitened norms of the residuals centred in the core, by kind."""
    start, stop = core.start, core.stop
    cut = {
        "accelerometer": (r.acceleration[start - 1 : stop - 1], terms.force_information[core]),
        "gyroscope": (r.rate[core], terms.rate_information[core]),
        "orientation": (r.orientation[core], terms.orientation_information[core]),
    }
    return {
        kind: loss(layout.inertial_loss, _squared(*pair), weights.inertial_scale)
        for kind, pair in cut.items()
    }


def robust_information(layout: Layout, residual: Array, information: Array, scale: Array) -> Array:
    """Information times the weight of the robust loss."""
    return information * weight(layout.inertial_loss, _squared(residual, information), scale)
