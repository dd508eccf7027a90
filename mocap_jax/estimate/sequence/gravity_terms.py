"""Gravity reference: what still boards say about tilt (`residuals.gravity.tilt_error`).

With u = R (f - b) / |f|, the direction in which a board feels gravity, and up z, the residual is
z x u. The size |f| is that of the reading: the residual is linear in the bias b. Its derivative by
the world rotation is -skew(z) skew(u), by the mounting that times R, and by what changes the
reading -skew(z) R / |f| times the change.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.corrected import unbiased
from mocap_jax.estimate.sequence.correction_terms import diagonal, gain_of
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.site_information import (
    SiteInformation,
    columns,
    matmul,
    with_one_frame,
)
from mocap_jax.estimate.sequence.window import Window
from mocap_jax.residuals.gravity import size
from mocap_jax.residuals.robust import loss, weight


def residuals(
    layout: Layout, w: Window, constants: Constants, terms: Terms, gravity: Array
) -> Float[Array, "n s 3"]:
    """Sine of every board's tilt error, about its axis in the world."""
    felt = unbiased(layout, constants, terms, terms.gravity[0])
    there = so3.matvec3(w.rotation, felt) / size(terms.gravity[0])[..., None]
    return so3.cross(jnp.broadcast_to(_up(gravity), there.shape), there)


def losses(
    layout: Layout, residual: Array, terms: Terms, weights: Weights, core: slice
) -> Float[Array, "c s"]:
    """Robust squared whitened norms in the core."""
    squared = terms.gravity[1][core] * (residual[core] ** 2).sum(-1)
    return loss(layout.gravity_loss, squared, weights.gravity_scale)


def add(
    layout: Layout,
    total: SiteInformation,
    w: Window,
    constants: Constants,
    terms: Terms,
    weights: Weights,
    gravity: Array,
    core: slice,
) -> SiteInformation:
    """Add the information of the gravity reference to that of inertial residuals."""
    residual = residuals(layout, w, constants, terms, gravity)[core]
    info = terms.gravity[1][core]
    squared = info * (residual**2).sum(-1)
    info = info * weight(layout.gravity_loss, squared, weights.gravity_scale)
    felt = unbiased(layout, constants, terms, terms.gravity[0])[core]
    norm = size(terms.gravity[0])[core][..., None]
    R = w.rotation[core]
    across = so3.skew(_up(gravity))
    turn = -matmul(across, so3.skew(so3.matvec3(R, felt) / norm))
    cols = columns(
        layout,
        matmul(turn, R),
        **_reading_columns(layout, constants, terms, felt, matmul(-across, R) / norm[..., None]),
    )
    return with_one_frame(layout, total, turn, cols, info, residual)


def _reading_columns(
    layout: Layout, constants: Constants, terms: Terms, felt: Array, by_bias: Array
) -> dict[str, Array]:
    """Columns of what changes a reading, from that by an unscaled bias."""
    scale = gain_of(constants.corrections.accelerometer_scale, layout.use_accelerometer_scale)
    own = by_bias * scale[..., None, :]
    out = {"accelerometer_bias": own}
    if layout.use_accelerometer_scale:
        out["accelerometer_scale"] = matmul(by_bias, diagonal(scale * felt))
    if layout.accelerometer_steps:
        core = slice(layout.halo, layout.halo + felt.shape[0])
        steps = terms.walk[0][core].T
        out["accelerometer_walk"] = jnp.concatenate(
            [share[:, None, None, None] * own for share in steps], axis=-1
        )
    return out


def _up(gravity: Float[Array, "3"]) -> Float[Array, "3"]:
    return -gravity / jnp.sqrt((gravity**2).sum())
