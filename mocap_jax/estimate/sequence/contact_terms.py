"""Standing feet in a whole-sequence problem: points that stay where they are, on level ground.

Three residuals a point: its displacement to the next frame, its height over the ground while it
stands, and its depth below the ground while it does not. Each has a robust loss of its own, so
that a contact that is none stops counting.

With the screws of the degrees of freedom about the root body's position o, a point x of a foot
moves by J = linear + angular x (x - o). A displacement has -J in its frame and J' in the next.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.geometry_terms import GeometryInformation, nothing
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.window import Window, lengths_above
from mocap_jax.residuals.contact import depth, displacement
from mocap_jax.residuals.robust import loss, weight


class Kind(NamedTuple):
    """Residuals of one kind in some frames, as `model_gradient.Part` takes them."""

    residual: Float[Array, "c p d"]
    information: Float[Array, "c p d"]
    loss: str
    scale: Array
    mu: Array

    @property
    def squared(self) -> Float[Array, "c p"]:
        """Squared whitened norms."""
        return (self.information * self.residual**2).sum(-1)

    @property
    def weighted(self) -> Float[Array, "c p d"]:
        """Information times the weight of the robust loss."""
        down = weight(self.loss, self.squared, self.scale, self.mu)
        return self.information * down[..., None]


def _points(w: Window, weights: Weights) -> Float[Array, "n p 3"]:
    return w.foot_position + so3.matvec3(w.foot_rotation, weights.ground.points)


def kinds(
    layout: Layout, w: Window, terms: Terms, weights: Weights, core: slice
) -> tuple[Kind, Kind, Kind]:
    """Displacements after the frames `core`, heights and depths in them."""
    x, own = _points(w, weights), weights.ground
    moved = displacement(x[core], x[core.start + 1 : core.stop + 1])
    height = x[core, :, 2:] - own.height
    # A frame counts as a part of an observation, which leaves its own whitened size as it is.
    partial = own.scale * jnp.sqrt(own.share)
    stays, stands, above = (info[core][..., None] for info in terms.contact)
    name = layout.contact_loss
    return (
        Kind(moved, jnp.broadcast_to(stays, moved.shape), name, own.scale, own.mu),
        Kind(height, stands, name, partial, own.mu),
        Kind(depth(height, weights.limit_softness), above, name, partial, own.mu),
    )


def losses(
    layout: Layout, w: Window, terms: Terms, weights: Weights, core: slice
) -> Float[Array, "c"]:
    """Robust squared whitened residuals of the core frames."""
    all_kinds = kinds(layout, w, terms, weights, core)
    return sum(loss(k.loss, k.squared, k.scale, k.mu).sum(-1) for k in all_kinds)


class Rows(NamedTuple):
    """Whitened residuals of c frames and of the one before, and their derivatives."""

    residual: Float[Array, "c+1 m"]
    """By frame: displacements of all points to the next frame (3 p), heights (p), depths (p)."""
    here: Float[Array, "c+1 m nv"]
    """By the poses of the frame."""
    there: Float[Array, "c+1 m nv"]
    """By those of the next one; zero but for displacements."""
    lengths: Float[Array, "c+1 m l"]
    """By the unknown lengths."""


def rows(layout: Layout, w: Window, terms: Terms, weights: Weights, core: slice) -> Rows:
    """Rows of the core frames, and of the frame before, whose displacements end in the core."""
    span = slice(core.start - 1, core.stop)
    found = kinds(layout, w, terms, weights, span)
    roots = [jnp.sqrt(k.weighted) for k in found]
    here, there = (
        _point_jacobian(layout, w, weights, slice(span.start + o, span.stop + o)) for o in (0, 1)
    )
    longer = [_longer(layout, w, slice(span.start + o, span.stop + o)) for o in (0, 1)]
    # No -1: without unknown lengths an array may be empty.
    flat = lambda x: x.reshape(len(x), x.shape[1] * x.shape[2], *x.shape[3:])  # noqa: E731

    def by(now: Array, change: Array) -> Array:
        """Whitened rows, from derivatives (c, p, 3, n) of points and of displacements."""
        vertical = now[:, :, 2:]
        parts = change, vertical, _depth_slope(found[1].residual, weights)[..., None] * vertical
        return jnp.concatenate(
            [flat(root[..., None] * part) for root, part in zip(roots, parts, strict=True)], axis=1
        )

    residual = [flat(root * k.residual) for root, k in zip(roots, found, strict=True)]
    return Rows(
        jnp.concatenate(residual, axis=1),
        by(here, -here),
        by(jnp.zeros_like(here), there),
        by(longer[0], longer[1] - longer[0]),
    )


def _depth_slope(height: Array, weights: Weights) -> Array:
    ones = jnp.ones_like(height)
    return jax.jvp(lambda x: depth(x, weights.limit_softness), (height,), (ones,))[1]


def _point_jacobian(
    layout: Layout, w: Window, weights: Weights, chosen: slice
) -> Float[Array, "c p 3 nv"]:
    arm = (_points(w, weights) - w.origin[:, None])[chosen]
    screws = jnp.swapaxes(w.screws[chosen], 1, 2)[:, None]
    moved = screws[..., :3] + so3.cross(screws[..., 3:], arm[:, :, None])
    mask = layout.topology.body_dofs[np.array(layout.contact_bodies)]
    return jnp.swapaxes(jnp.where(mask[:, :, None], moved, 0.0), -1, -2)


def _longer(layout: Layout, w: Window, chosen: slice) -> Float[Array, "c p 3 l"]:
    mask = lengths_above(layout, layout.contact_bodies)
    spans = jnp.swapaxes(w.spans[chosen], 1, 2)[:, None]
    return jnp.where(mask[:, None, :], spans, 0.0)


def normal_blocks(r: Rows) -> tuple[tuple[Array, Array], Array]:
    """Blocks on and beside the diagonal, and the gradient, of the core frames."""
    square = _product(r.here[1:], r.here[1:]) + _product(r.there[:-1], r.there[:-1])
    coupling = _product(r.there[1:], r.here[1:])
    return (square, coupling), _pull(r.here[1:], r.residual[1:]) + _pull(
        r.there[:-1], r.residual[:-1]
    )


def of_lengths(layout: Layout, r: Rows, frames: int) -> GeometryInformation:
    """What the core frames say about the unknown lengths."""
    none = nothing(layout, frames, r.residual.dtype)
    own = slice(0, len(layout.lengths))
    longer = r.lengths[1:]
    border = _product(longer, r.here[1:]) + _product(r.lengths[:-1], r.there[:-1])
    return none._replace(
        border=none.border.at[:, own].set(border),
        square=none.square.at[own, own].set(_product(longer, longer).sum(0)),
        gradient=none.gradient.at[own].set(_pull(longer, r.residual[1:]).sum(0)),
    )


def _product(a: Float[Array, "c m v"], b: Float[Array, "c m w"]) -> Float[Array, "c v w"]:
    return jnp.einsum("cmv,cmw->cvw", a, b)


def _pull(a: Float[Array, "c m v"], residual: Float[Array, "c m"]) -> Float[Array, "c v"]:
    return jnp.einsum("cmv,cm->cv", a, residual)
