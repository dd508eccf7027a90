"""Range residuals of a chunk and their contribution to the normal equations."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.window import Window, range_dofs
from mocap_jax.residuals.ranges import faces_receiver, point_wrench, range_residual
from mocap_jax.residuals.robust import loss, weight


class RangeResiduals(NamedTuple):
    """Residuals of frames 1 .. n - 1 of a chunk; each belongs to the interval before its frame."""

    residual: Float[Array, "n-1 k"]
    """[m]"""
    direction: Float[Array, "n-1 k 3"]
    """Unit vector from the source to the receiver."""


def residuals(w: Window, terms: Terms) -> RangeResiduals:
    """All range residuals of a chunk."""
    rows = jnp.arange(1, w.range_position.shape[0])[:, None]

    def ends(index: Array) -> Array:
        chosen = index[1:]
        return jnp.stack([w.range_position[rows - 1, chosen], w.range_position[rows, chosen]], 2)

    source, receiver = ends(terms.range_source), ends(terms.range_receiver)
    cells = (terms.range_distance[1:], terms.range_lead[1:], terms.range_flight[1:])
    residual = jax.vmap(jax.vmap(range_residual))(source, receiver, *cells)
    lead, late = terms.range_lead[1:, :, None], (terms.range_lead - terms.range_flight)[1:, :, None]
    emitted = lead * source[:, :, 0] + (1 - lead) * source[:, :, 1]
    arrived = late * receiver[:, :, 0] + (1 - late) * receiver[:, :, 1]
    between = arrived - emitted
    # Absent ranges point a site at itself: keep their direction finite.
    norm = jnp.sqrt(jnp.maximum((between * between).sum(-1, keepdims=True), 1e-12))
    present = terms.range_information[1:] > 0
    return RangeResiduals(jnp.where(present, residual, 0.0), between / norm)


def gate(w: Window, terms: Terms) -> Float[Array, "n k"]:
    """The gate w_a of every range: 1 where the receiver is in front of the source."""
    rows = jnp.arange(w.range_position.shape[0])[:, None]
    source, receiver = terms.range_source, terms.range_receiver
    return faces_receiver(
        w.range_rotation[rows, source],
        w.range_position[rows, source],
        w.range_position[rows, receiver],
    )


def losses(
    layout: Layout, r: RangeResiduals, terms: Terms, weights: Weights, core: slice
) -> Float[Array, "c k"]:
    """Robust squared whitened residuals of the core frames."""
    squared = terms.range_information[core] * r.residual[core.start - 1 : core.stop - 1] ** 2
    return loss(layout.range_loss, squared, weights.range_scale, weights.range_mu)


def normal_blocks(
    layout: Layout, w: Window, r: RangeResiduals, terms: Terms, weights: Weights, core: slice
) -> tuple[tuple[Array, Array], Array]:
    """Contribution of ranges to the normal equations of the core frames.

    Returns:
        ((block k k, block k+1 k), gradient) of shapes (c, nv, nv) and (c, nv).
    """
    squared = terms.range_information[1:] * r.residual**2
    robust = weight(layout.range_loss, squared, weights.range_scale, weights.range_mu)
    root = jnp.sqrt(terms.range_information[1:] * robust)[..., None]
    lead = terms.range_lead[1:, :, None]
    late = lead - terms.range_flight[1:, :, None]
    whitened = root[..., 0] * r.residual
    # Rows for frames core.start .. core.stop (one more: that interval touches the last frame).
    later = slice(core.start - 1, core.stop)
    now = root * _rows(layout, w, r, terms, 1, 1 - late, 1 - lead)
    before = root * _rows(layout, w, r, terms, 0, late, lead)
    now, before, whitened = now[later], before[later], whitened[later]
    square = jnp.einsum("nki,nkj->nij", now[:-1], now[:-1])
    square = square + jnp.einsum("nki,nkj->nij", before[1:], before[1:])
    coupling = jnp.einsum("nki,nkj->nij", now[1:], before[1:])
    gradient = (now[:-1] * whitened[:-1, :, None]).sum(1)
    gradient = gradient + (before[1:] * whitened[1:, :, None]).sum(1)
    return (square, coupling), gradient


def _rows(
    layout: Layout,
    w: Window,
    r: RangeResiduals,
    terms: Terms,
    shift: int,
    receiver_share: Array,
    source_share: Array,
) -> Float[Array, "n-1 k nv"]:
    """Jacobian rows by the pose of frame k - 1 (shift 0) or k (shift 1)."""
    frames = slice(shift, shift + r.residual.shape[0])
    mask = jnp.asarray(range_dofs(layout), r.residual.dtype)
    position, origin, screws = w.range_position[frames], w.origin[frames], w.screws[frames]
    index = jnp.arange(position.shape[0])[:, None]

    def speeds(sites: Array, share: Array) -> Array:
        point = position[index, sites] - origin[:, None, :]
        wrench = share * point_wrench(point, r.direction)
        along = sum(wrench[:, :, p, None] * screws[:, p, None, :] for p in range(6))
        return along * mask[sites]

    receivers, sources = terms.range_receiver[1:], terms.range_source[1:]
    return speeds(receivers, receiver_share) - speeds(sources, source_share)
