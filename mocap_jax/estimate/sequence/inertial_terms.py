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

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.geometry_terms import AccelerationRows
from mocap_jax.estimate.sequence.inertial_residuals import (
    InertialResiduals,
    robust_information,
)
from mocap_jax.estimate.sequence.layout import (
    CONSTANTS_PER_SENSOR,
    Constants,
    Layout,
    Terms,
    Weights,
)
from mocap_jax.estimate.sequence.window import Window
from mocap_jax.residuals.inertial import (
    acceleration_jacobian,
    rate_jacobian,
)


class SiteInformation(NamedTuple):
    """J'WJ and J'Wr per sensor of the core frames of a chunk."""

    blocks: tuple[Float[Array, "c s 6 6"], ...]
    """[o]: rows twist at frame k + o, columns twist at frame k."""
    gradient: Float[Array, "c s 6"]
    border: Float[Array, "c s 6 12"]
    """Rows twist at frame k, columns the sensor's constants."""
    constants: Float[Array, "s 12 12"]
    constants_gradient: Float[Array, "s 12"]
    accelerations: AccelerationRows | None = None
    """What the segment lengths need."""


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
    n = CONSTANTS_PER_SENSOR
    border = jnp.zeros((size, sensors, 6, n), w.position.dtype)
    corner = jnp.zeros((sensors, n, n), w.position.dtype)
    corner_gradient = jnp.zeros((sensors, n), w.position.dtype)
    total = SiteInformation(tuple(blocks), gradient, border, corner, corner_gradient)
    if layout.use_acceleration:
        total = _add_acceleration(layout, total, w, constants, terms, weights, r, core)
    if layout.use_rate:
        total = _add_rate(layout, total, w, constants, terms, weights, r, core)
    if layout.use_orientation:
        total = _add_orientation(layout, total, w, terms, weights, r, core)
    return total


def _angular_rows(x: Array) -> Array:
    """(..., 6, n) from its angular rows (..., 3, n); a scatter-add would not fuse."""
    return jnp.concatenate([jnp.zeros_like(x), x], axis=-2)


def _stack(ll: Array, lw: Array, wl: Array, ww: Array) -> Array:
    """6x6 blocks from their 3x3 parts (linear, angular)."""
    top = jnp.concatenate([ll, lw], axis=-1)
    return jnp.concatenate([top, jnp.concatenate([wl, ww], axis=-1)], axis=-2)


def _columns(
    mounting: Array,
    *,
    gyroscope: Array | None = None,
    accelerometer: Array | None = None,
    offset: Array | None = None,
) -> Array:
    """(..., 3, 12) Jacobian by a sensor's constants."""
    zero = jnp.zeros_like(mounting)
    parts = (gyroscope, accelerometer, mounting, offset)
    return jnp.concatenate([zero if p is None else p for p in parts], axis=-1)


def _matmul(a: Array, b: Array) -> Array:
    """Batched product with a short contraction, as multiply-sum."""
    return (a[..., :, :, None] * b[..., None, :, :]).sum(axis=-2)


def _transpose(a: Array) -> Array:
    return jnp.swapaxes(a, -1, -2)


def _outer(a: Array, b: Array) -> Array:
    return a[..., :, None] * b[..., None, :]


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
    force = terms.force - constants.accelerometer_bias
    jacobian = acceleration_jacobian(
        (w.rotation[:-2], w.rotation[1:-1], w.rotation[2:]),
        (force[:-2], force[1:-1], force[2:]),
        weights.step,
        layout.force_weights,
    )
    info = robust_information(
        layout, r.acceleration, terms.force_information[1:-1], weights.inertial_scale
    )
    relative = w.position - w.origin[:, None, :]
    alpha = jacobian.alpha
    n = w.position.shape[0]
    y = [jacobian.turn[j] - alpha[j] * relative[j : n - 2 + j] for j in range(3)]
    start, size = core.start, core.stop - core.start
    eye = jnp.eye(3, dtype=info.dtype)

    def centred(x: Array, offset: int) -> Array:
        """Rows of x (by centre) whose window has core frame k at place `offset` (-1, 0, 1)."""
        first = start - offset - 1
        return x[first : first + size]

    blocks = list(total.blocks)
    for later in range(3):
        for earlier in range(later + 1):
            place = earlier - 1
            wt = centred(info, place)
            y_l, y_e = centred(y[later], place), centred(y[earlier], place)
            ll = (wt * alpha[later] * alpha[earlier])[..., None, None] * eye
            lw = so3.skew((wt * alpha[later])[..., None] * y_e)
            wl = -so3.skew((wt * alpha[earlier])[..., None] * y_l)
            dot = (wt * (y_l * y_e).sum(-1))[..., None, None] * eye
            ww = dot - _outer(wt[..., None] * y_e, y_l)
            blocks[later - earlier] = blocks[later - earlier] + _stack(ll, lw, wl, ww)
    gradient, border = total.gradient, total.border
    second = sum(alpha[j] * w.site_rotation[j : n - 2 + j] for j in range(3))
    columns = _columns(jacobian.mounting, accelerometer=jacobian.bias, offset=second)
    weighted = info[..., None] * r.acceleration
    for j in range(3):
        force_j = alpha[j] * centred(weighted, j - 1)
        moment_j = so3.cross(centred(weighted, j - 1), centred(y[j], j - 1))
        gradient = gradient + jnp.concatenate([force_j, moment_j], axis=-1)
        if layout.use_border:
            cols = centred(info[..., None, None] * columns, j - 1)
            angular = _matmul(_transpose(so3.skew(centred(y[j], j - 1))), cols)
            border = border + jnp.concatenate([alpha[j] * cols, angular], axis=-2)
    corner, corner_gradient = _corner(layout, total, columns, info, r.acceleration, start - 1, size)
    rows = AccelerationRows(r.acceleration, info, alpha, y, columns)
    return SiteInformation(tuple(blocks), gradient, border, corner, corner_gradient, rows)


def _corner(
    layout: Layout,
    total: SiteInformation,
    columns: Array,
    info: Array,
    residual: Array,
    first: int,
    size: int,
) -> tuple[Array, Array]:
    """Add J'WJ and J'Wr by the constants over residuals first .. first + size."""
    if not layout.use_border:
        return total.constants, total.constants_gradient
    c, wt, r = (x[first : first + size] for x in (columns, info, residual))
    square = jnp.einsum("nsap,ns,nsaq->spq", c, wt, c)
    slope = jnp.einsum("nsap,ns,nsa->sp", c, wt, r)
    return total.constants + square, total.constants_gradient + slope


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
    rate = terms.rate - constants.gyroscope_bias
    jacobian = rate_jacobian(
        (w.rotation[:-1], w.rotation[1:]), r.turned, (rate[:-1], rate[1:]), weights.step
    )
    info = robust_information(layout, r.rate, terms.rate_information[:-1], weights.inertial_scale)
    weighted_turn = info[..., None, None] * jacobian.turn
    square = _matmul(_transpose(jacobian.turn), weighted_turn)
    pull = (weighted_turn * r.rate[..., :, None]).sum(axis=-2)
    here, before = slice(core.start, core.stop), slice(core.start - 1, core.stop - 1)
    zero = jnp.zeros_like(square[here])
    angular = lambda x: _stack(zero, zero, zero, x)  # noqa: E731
    # Interval k joins frames k (Jacobian -turn) and k + 1 (+turn).
    blocks = list(total.blocks)
    blocks[0] = blocks[0] + angular(square[here] + square[before])
    blocks[1] = blocks[1] - angular(square[here])
    moment = pull[before] - pull[here]
    gradient = total.gradient + _angular_rows(moment[..., None])[..., 0]
    border = total.border
    columns = _columns(jacobian.mounting, gyroscope=jacobian.bias)
    if layout.use_border:
        coupled = _matmul(_transpose(weighted_turn), columns)
        border = border + _angular_rows(coupled[before] - coupled[here])
    size = core.stop - core.start
    corner, corner_gradient = _corner(layout, total, columns, info, r.rate, core.start, size)
    return SiteInformation(
        tuple(blocks), gradient, border, corner, corner_gradient, total.accelerations
    )


def _add_orientation(
    layout: Layout,
    total: SiteInformation,
    w: Window,
    terms: Terms,
    weights: Weights,
    r: InertialResiduals,
    core: slice,
) -> SiteInformation:
    residual = r.orientation[core]
    info = robust_information(
        layout, residual, terms.orientation_information[core], weights.inertial_scale
    )
    inverse = so3.right_jacobian_inverse(residual)
    turn = so3.matmul3(inverse, _transpose(w.rotation[core]))
    weighted_turn = info[..., None, None] * turn
    square = _matmul(_transpose(turn), weighted_turn)
    zero = jnp.zeros_like(square)
    blocks = list(total.blocks)
    blocks[0] = blocks[0] + _stack(zero, zero, zero, square)
    pull = (weighted_turn * residual[..., :, None]).sum(axis=-2)
    gradient = total.gradient + _angular_rows(pull[..., None])[..., 0]
    border = total.border
    columns = _columns(inverse)
    if layout.use_border:
        border = border + _angular_rows(_matmul(_transpose(weighted_turn), columns))
    size = core.stop - core.start
    corner, corner_gradient = _corner(layout, total, columns, info, residual, 0, size)
    return SiteInformation(
        tuple(blocks), gradient, border, corner, corner_gradient, total.accelerations
    )
