"""`SiteInformation`: what inertial residuals say about sensors, and its parts."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.estimate.sequence.geometry_terms import AccelerationRows
from mocap_jax.estimate.sequence.layout import Layout


class SiteInformation(NamedTuple):
    """J'WJ and J'Wr per sensor of the core frames of a chunk; n is `Layout.per_sensor`."""

    blocks: tuple[Float[Array, "c s 6 6"], ...]
    """[o]: rows twist at frame k + o, columns twist at frame k."""
    gradient: Float[Array, "c s 6"]
    border: Float[Array, "c s 6 n"]
    """Rows twist at frame k, columns the sensor's constants."""
    constants: Float[Array, "s n n"]
    constants_gradient: Float[Array, "s n"]
    accelerations: AccelerationRows | None = None
    """What the segment lengths need."""


def angular_rows(x: Array) -> Array:
    """(..., 6, n) from its angular rows (..., 3, n); a scatter-add would not fuse."""
    return jnp.concatenate([jnp.zeros_like(x), x], axis=-2)


def stack(ll: Array, lw: Array, wl: Array, ww: Array) -> Array:
    """6x6 blocks from their 3x3 parts (linear, angular)."""
    top = jnp.concatenate([ll, lw], axis=-1)
    return jnp.concatenate([top, jnp.concatenate([wl, ww], axis=-1)], axis=-2)


def angular_block(ww: Array) -> Array:
    """6x6 blocks with angular parts only."""
    zero = jnp.zeros_like(ww)
    return stack(zero, zero, zero, ww)


def columns(layout: Layout, mounting: Array, **others: Array) -> Array:
    """(..., 3, n) Jacobian by a sensor's constants, from the parts that are not zero."""
    parts = {"mounting": mounting, **others}
    zero = jnp.zeros_like(mounting[..., :1])
    return jnp.concatenate(
        [
            parts[kind] if kind in parts else jnp.broadcast_to(zero, (*zero.shape[:-1], size))
            for kind, size in layout.sensor_sizes.items()
            if size
        ],
        axis=-1,
    )


def matmul(a: Array, b: Array) -> Array:
    """Batched product with a short contraction, as multiply-sum."""
    return (a[..., :, :, None] * b[..., None, :, :]).sum(axis=-2)


def transpose(a: Array) -> Array:
    """The last two axes exchanged."""
    return jnp.swapaxes(a, -1, -2)


def outer(a: Array, b: Array) -> Array:
    """a b'."""
    return a[..., :, None] * b[..., None, :]


def corner(
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


def with_one_frame(
    layout: Layout,
    total: SiteInformation,
    turn: Float[Array, "c s 3 3"],
    cols: Float[Array, "c s 3 n"],
    info: Float[Array, "c s"],
    residual: Float[Array, "c s 3"],
) -> SiteInformation:
    """Add residuals that each see the world rotation of one core frame.

    Args:
        layout: shape of the problem.
        total: to add to.
        turn: Jacobian by the world rotation.
        cols: by the sensor's constants.
        info: information, robust weight included.
        residual: of the core frames.
    """
    weighted = info[..., None, None] * turn
    blocks = list(total.blocks)
    blocks[0] = blocks[0] + angular_block(matmul(transpose(turn), weighted))
    pull = (weighted * residual[..., :, None]).sum(axis=-2)
    gradient = total.gradient + angular_rows(pull[..., None])[..., 0]
    border = total.border
    if layout.use_border:
        border = border + angular_rows(matmul(transpose(weighted), cols))
    found = corner(layout, total, cols, info, residual, 0, len(residual))
    return SiteInformation(tuple(blocks), gradient, border, *found, total.accelerations)
