"""The information that inertial residuals give about each sensor's motion.

A residual depends on the pose only through the twist of its sensor in a few frames. So its
information is first gathered as 6x6 blocks per sensor and pair of frames, all kinds together; the
step to joint coordinates (`composite`) is then the same for all and touches each pair of degrees
of freedom once.

In twist coordinates (linear, angular about the chunk's origins) the Jacobian of an acceleration
residual by frame j is [alpha_j I, skew(y_j)], y_j = x_j - alpha_j p_j; that of a rate residual
[0, -+turn].
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from mocap_jax import so3
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.corrected import force_rotation, forces, rates
from mocap_jax.estimate.sequence.correction_terms import acceleration_columns, rate_columns
from mocap_jax.estimate.sequence.geometry_terms import AccelerationRows
from mocap_jax.estimate.sequence.inertial_residuals import (
    InertialResiduals,
    robust_information,
)
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.orientation_terms import add_orientations
from mocap_jax.estimate.sequence.site_information import (
    SiteInformation,
    angular_block,
    angular_rows,
    columns,
    corner,
    matmul,
    outer,
    stack,
    transpose,
)
from mocap_jax.estimate.sequence.window import Window
from mocap_jax.residuals.inertial import (
    acceleration_jacobian,
    rate_jacobian,
    without_turns,
)


def information(
    layout: Layout,
    w: Window,
    constants: Constants,
    terms: Terms,
    weights: Weights,
    r: InertialResiduals,
    core: slice,
) -> SiteInformation:
    """Gather the information of all inertial residuals that touch the core frames."""
    size = core.stop - core.start
    sensors = w.position.shape[1]
    blocks = [jnp.zeros((size, sensors, 6, 6), w.position.dtype) for _ in range(3)]
    gradient = jnp.zeros((size, sensors, 6), w.position.dtype)
    n = layout.per_sensor
    border = jnp.zeros((size, sensors, 6, n), w.position.dtype)
    square = jnp.zeros((sensors, n, n), w.position.dtype)
    slope = jnp.zeros((sensors, n), w.position.dtype)
    total = SiteInformation(tuple(blocks), gradient, border, square, slope)
    if layout.use_acceleration:
        total = _add_acceleration(layout, total, w, constants, terms, weights, r, core)
    if layout.use_rate:
        total = _add_rate(layout, total, w, constants, terms, weights, r, core)
    if layout.use_orientation:
        total = add_orientations(layout, total, w, constants, terms, weights, r.orientation, core)
    return total


def _add_acceleration(
    layout: Layout,
    total: SiteInformation,
    w: Window,
    constants: Constants,
    terms: Terms,
    weights: Weights,
    r: InertialResiduals,
    core: slice,
) -> SiteInformation:
    force = forces(layout, constants, terms)
    rotation = force_rotation(layout, w, terms)
    jacobian = acceleration_jacobian(
        (rotation[:-2], rotation[1:-1], rotation[2:]),
        (force[:-2], force[1:-1], force[2:]),
        weights.step,
        layout.force_weights,
    )
    if layout.measured_rotation:
        jacobian = without_turns(jacobian)
    info = robust_information(
        layout, r.acceleration, terms.force_information[1:-1], weights.inertial_scale
    )
    relative = w.position - w.origin[:, None, :]
    alpha = jacobian.alpha
    n = w.position.shape[0]
    y = [jacobian.turn[j] - alpha[j] * relative[j : n - 2 + j] for j in range(3)]
    blocks = _acceleration_blocks(total.blocks, info, alpha, y, core)
    second = sum(alpha[j] * w.site_rotation[j : n - 2 + j] for j in range(3))
    others = acceleration_columns(layout, rotation, constants, terms, force, jacobian.bias)
    cols = columns(layout, jacobian.mounting, offset=second, **others)
    rows = AccelerationRows(r.acceleration, info, alpha, y, cols)
    gradient, border = _acceleration_slopes(layout, total, rows, core)
    found = corner(
        layout, total, cols, info, r.acceleration, core.start - 1, core.stop - core.start
    )
    return SiteInformation(blocks, gradient, border, *found, rows)


def _centred(x: Array, core: slice, place: int) -> Array:
    """Rows of x (by centre) whose window has core frame k at `place` (-1, 0, 1)."""
    first = core.start - place - 1
    return x[first : first + core.stop - core.start]


def _acceleration_blocks(
    blocks: tuple[Array, ...], info: Array, alpha: Array, y: list[Array], core: slice
) -> tuple[Array, ...]:
    """Blocks of frames none, one and two apart, those of accelerations added."""
    out = list(blocks)
    eye = jnp.eye(3, dtype=info.dtype)
    for later in range(3):
        for earlier in range(later + 1):
            place = earlier - 1
            wt = _centred(info, core, place)
            y_l, y_e = _centred(y[later], core, place), _centred(y[earlier], core, place)
            ll = (wt * alpha[later] * alpha[earlier])[..., None, None] * eye
            lw = so3.skew((wt * alpha[later])[..., None] * y_e)
            wl = -so3.skew((wt * alpha[earlier])[..., None] * y_l)
            dot = (wt * (y_l * y_e).sum(-1))[..., None, None] * eye
            ww = dot - outer(wt[..., None] * y_e, y_l)
            out[later - earlier] = out[later - earlier] + stack(ll, lw, wl, ww)
    return tuple(out)


def _acceleration_slopes(
    layout: Layout, total: SiteInformation, rows: AccelerationRows, core: slice
) -> tuple[Array, Array]:
    """Gradient and border, those of accelerations added."""
    gradient, border = total.gradient, total.border
    weighted = rows.information[..., None] * rows.residual
    for j in range(3):
        y = _centred(rows.y[j], core, j - 1)
        force = rows.alpha[j] * _centred(weighted, core, j - 1)
        moment = so3.cross(_centred(weighted, core, j - 1), y)
        gradient = gradient + jnp.concatenate([force, moment], axis=-1)
        if layout.use_border:
            by = _centred(rows.information[..., None, None] * rows.columns, core, j - 1)
            angular = matmul(transpose(so3.skew(y)), by)
            border = border + jnp.concatenate([rows.alpha[j] * by, angular], axis=-2)
    return gradient, border


def _add_rate(
    layout: Layout,
    total: SiteInformation,
    w: Window,
    constants: Constants,
    terms: Terms,
    weights: Weights,
    r: InertialResiduals,
    core: slice,
) -> SiteInformation:
    rate, mean = rates(layout, constants, terms)
    jacobian = rate_jacobian(
        (w.rotation[:-1], w.rotation[1:]), r.turned, (rate[:-1], rate[1:]), weights.step
    )
    info = robust_information(layout, r.rate, terms.rate_information[:-1], weights.inertial_scale)
    weighted_turn = info[..., None, None] * jacobian.turn
    square = matmul(transpose(jacobian.turn), weighted_turn)
    pull = (weighted_turn * r.rate[..., :, None]).sum(axis=-2)
    here, before = slice(core.start, core.stop), slice(core.start - 1, core.stop - 1)
    # Interval k joins frames k (Jacobian -turn) and k + 1 (+turn).
    blocks = list(total.blocks)
    blocks[0] = blocks[0] + angular_block(square[here] + square[before])
    blocks[1] = blocks[1] - angular_block(square[here])
    moment = pull[before] - pull[here]
    gradient = total.gradient + angular_rows(moment[..., None])[..., 0]
    border = total.border
    others = rate_columns(layout, constants, terms, rate, mean, jacobian.bias, weights.step)
    cols = columns(layout, jacobian.mounting, **others)
    if layout.use_border:
        coupled = matmul(transpose(weighted_turn), cols)
        border = border + angular_rows(coupled[before] - coupled[here])
    size = core.stop - core.start
    found = corner(layout, total, cols, info, r.rate, core.start, size)
    return SiteInformation(tuple(blocks), gradient, border, *found, total.accelerations)
