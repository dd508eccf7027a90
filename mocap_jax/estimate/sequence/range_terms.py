"""Range residuals of a chunk and their contribution to the normal equations."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.estimate.sequence.geometry_terms import GeometryInformation
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.window import (
    Window,
    lengths_beneath,
    place_among,
    range_dofs,
    sensor_of_range_site,
    source_of_range_site,
)
from mocap_jax.residuals.ranges import faces_receiver, point_wrench, range_residual
from mocap_jax.residuals.robust import loss, weight

# Most ranges a frame whose products are written out; beyond, the program would grow too long.
_UNROLLED = 40


class RangeResiduals(NamedTuple):
    """Residuals of frames 1 .. n - 1 of a chunk; each belongs to the interval before its frame."""

    residual: Float[Array, "n-1 k"]
    """[m]"""
    direction: Float[Array, "n-1 k 3"]
    """From the source to the receiver; the residual's derivative by the receiver's position."""


def residuals(w: Window, terms: Terms) -> RangeResiduals:
    """All range residuals of a chunk."""
    rows = jnp.arange(1, w.range_position.shape[0])[:, None]

    def ends(position: Array, index: Array) -> Array:
        chosen = index[1:]
        return jnp.stack([position[rows - 1, chosen], position[rows, chosen]], 2)

    source = ends(w.source_position, terms.range_source)
    receiver = ends(w.range_position, terms.range_receiver)
    # Times of flight are what is measured: were distances scaled instead, shrinking body and speed
    # of sound together would shrink all residuals.
    scale = w.range_scale
    cells = (scale * terms.range_distance[1:], terms.range_lead[1:], terms.range_flight[1:])
    residual = jax.vmap(jax.vmap(range_residual))(source, receiver, *cells) / scale
    residual = residual + w.range_offset[terms.range_source[1:]]
    lead, late = terms.range_lead[1:, :, None], (terms.range_lead - terms.range_flight)[1:, :, None]
    emitted = lead * source[:, :, 0] + (1 - lead) * source[:, :, 1]
    arrived = late * receiver[:, :, 0] + (1 - late) * receiver[:, :, 1]
    between = arrived - emitted
    # Absent ranges point a site at itself: keep their direction finite.
    norm = jnp.sqrt(jnp.maximum((between * between).sum(-1, keepdims=True), 1e-12))
    present = terms.range_information[1:] > 0
    return RangeResiduals(jnp.where(present, residual, 0.0), between / norm / scale)


def gate(w: Window, terms: Terms) -> Float[Array, "n k"]:
    """The gate w_a of every range: 1 where the receiver is in front of the source."""
    rows = jnp.arange(w.range_position.shape[0])[:, None]
    source, receiver = terms.range_source, terms.range_receiver
    return faces_receiver(
        w.range_rotation[rows, source],
        w.source_position[rows, source],
        w.range_position[rows, receiver],
    )


def losses(
    layout: Layout, r: RangeResiduals, terms: Terms, weights: Weights, core: slice
) -> Float[Array, "c k"]:
    """Robust squared whitened residuals of the core frames."""
    squared = terms.range_information[core] * r.residual[core.start - 1 : core.stop - 1] ** 2
    return loss(layout.range_loss, squared, weights.range_scale, weights.range_mu)


class RangeRows(NamedTuple):
    """Whitened Jacobian rows of the core frames and the one after them (c + 1 rows)."""

    now: Float[Array, "c+1 k nv"]
    """By the pose of frame k."""
    before: Float[Array, "c+1 k nv"]
    """By the pose of frame k - 1."""
    offset: Float[Array, "c+1 k 3"]
    """By the receiver's offset on its segment."""
    residual: Float[Array, "c+1 k"]
    receiver: Float[Array, "c+1 k s"]
    """1 where a sensor is the receiver."""
    geometry: Float[Array, "c+1 k g"]
    """By the constants that belong to no sensor."""


def rows(
    layout: Layout, w: Window, r: RangeResiduals, terms: Terms, weights: Weights, core: slice
) -> RangeRows:
    """Whitened Jacobian rows of all ranges that touch the core frames."""
    squared = terms.range_information[1:] * r.residual**2
    robust = weight(layout.range_loss, squared, weights.range_scale, weights.range_mu)
    root = jnp.sqrt(terms.range_information[1:] * robust)[..., None]
    lead = terms.range_lead[1:, :, None]
    late = lead - terms.range_flight[1:, :, None]
    # Frames core.start .. core.stop: the interval after the last core frame touches it.
    cut = slice(core.start - 1, core.stop)
    sensor = sensor_of_range_site(layout)[:, None] == np.arange(len(layout.sites))
    receivers = terms.range_receiver[1:]
    index = jnp.arange(receivers.shape[0])[:, None]
    turn = w.range_rotation
    axes = (1 - late)[..., None] * turn[index + 1, receivers] + late[..., None] * turn[
        index, receivers
    ]
    along = (axes * r.direction[..., :, None]).sum(-2)
    geometry = _geometry_rows(layout, w, r, terms)
    return RangeRows(
        (root * _rows(layout, w, r, terms, 1, 1 - late, 1 - lead))[cut],
        (root * _rows(layout, w, r, terms, 0, late, lead))[cut],
        (root * along)[cut],
        (root[..., 0] * r.residual)[cut],
        jnp.asarray(sensor, root.dtype)[receivers][cut],
        (root * geometry)[cut],
    )


def _geometry_rows(
    layout: Layout, w: Window, r: RangeResiduals, terms: Terms
) -> Float[Array, "n-1 k g"]:
    """Derivatives by segment lengths, source positions, speed of sound and range offsets."""
    if not layout.geometry:
        return jnp.zeros((*r.residual.shape, 0), r.residual.dtype)
    source, receiver = terms.range_source[1:], terms.range_receiver[1:]
    lead = terms.range_lead[1:, :, None]
    late = lead - terms.range_flight[1:, :, None]
    columns = []
    if layout.lengths:
        beneath = jnp.asarray(lengths_beneath(layout, layout.range_sites), lead.dtype)
        before, now = (
            jnp.einsum("nkp,nlp->nkl", r.direction, spans) for spans in (w.spans[:-1], w.spans[1:])
        )
        arrived = beneath[receiver] * (late * before + (1 - late) * now)
        columns.append(arrived - beneath[source] * (lead * before + (1 - lead) * now))
    if layout.sources:
        index = jnp.arange(source.shape[0])[:, None]
        turn = w.range_rotation
        axes = (
            lead[..., None] * turn[index, source] + (1 - lead)[..., None] * turn[index + 1, source]
        )
        along = -(axes * r.direction[..., :, None]).sum(-2)
        of_site = source_of_range_site(layout)[:, None] == np.arange(len(layout.sources))
        chosen = jnp.asarray(of_site, lead.dtype)[source]
        both = chosen[..., :, None] * along[..., None, :]
        columns.append(both.reshape(*both.shape[:2], -1))
    if layout.use_sound:
        predicted = r.residual - w.range_offset[source] + terms.range_distance[1:]
        columns.append(-predicted[..., None] / w.range_scale)
    if layout.emitters:
        of_site = place_among(layout.emitters, layout)[:, None] == np.arange(len(layout.emitters))
        columns.append(jnp.asarray(of_site, lead.dtype)[source])
    return jnp.concatenate(columns, axis=-1)


def normal_blocks(x: RangeRows) -> tuple[tuple[Array, Array], Array]:
    """Contribution of ranges to the normal equations of the core frames.

    Returns:
        ((block k k, block k+1 k), gradient) of shapes (c, nv, nv) and (c, nv).
    """
    square = _gram(x.now[:-1], x.now[:-1]) + _gram(x.before[1:], x.before[1:])
    coupling = _gram(x.now[1:], x.before[1:])
    gradient = (x.now[:-1] * x.residual[:-1, :, None]).sum(1)
    return (square, coupling), gradient + (x.before[1:] * x.residual[1:, :, None]).sum(1)


def _gram(a: Float[Array, "n k i"], b: Float[Array, "n k j"]) -> Float[Array, "n i j"]:
    """a' b per frame, as rank-one terms that fuse into one loop."""
    if a.shape[1] > _UNROLLED:
        return jnp.einsum("nki,nkj->nij", a, b)
    return sum(a[:, k, :, None] * b[:, k, None, :] for k in range(a.shape[1]))


class RangeBorder(NamedTuple):
    """What ranges say about the receivers' offsets and the geometry."""

    offset: Float[Array, "c s 3 nv"]
    offset_square: Float[Array, "s 3 3"]
    offset_gradient: Float[Array, "s 3"]
    geometry: GeometryInformation


def border(layout: Layout, x: RangeRows) -> RangeBorder:
    """Coupling of ranges to the constants, and what they say about these alone."""
    selected = x.receiver[..., :, None] * x.offset[..., None, :]
    n, k, s, _ = selected.shape
    flat = jnp.concatenate([selected.reshape(n, k, s * 3), x.geometry], axis=-1)
    coupling = jnp.einsum("nkm,nkj->nmj", flat[:-1], x.now[:-1])
    coupling = coupling + jnp.einsum("nkm,nkj->nmj", flat[1:], x.before[1:])
    receiver, offset, residual, geometry = (
        y[:-1] for y in (x.receiver, x.offset, x.residual, x.geometry)
    )
    cross = jnp.einsum("nks,nkp,nkg->spg", receiver, offset, geometry)
    cells = layout.sensor_cells["offset"]
    return RangeBorder(
        coupling[:, : 3 * s].reshape(n - 1, s, 3, -1),
        jnp.einsum("nks,nkp,nkq->spq", receiver, offset, offset),
        jnp.einsum("nks,nkp,nk->sp", receiver, offset, residual),
        GeometryInformation(
            coupling[:, 3 * s :],
            jnp.pad(cross, ((0, 0), (cells.start, layout.per_sensor - cells.stop), (0, 0))),
            jnp.einsum("nkg,nkh->gh", geometry, geometry),
            jnp.einsum("nkg,nk->g", geometry, residual),
        ),
    )


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
    origin, screws = w.origin[frames], w.screws[frames]
    index = jnp.arange(origin.shape[0])[:, None]

    def speeds(position: Array, sites: Array, share: Array) -> Array:
        point = position[index, sites] - origin[:, None, :]
        wrench = share * point_wrench(point, r.direction)
        along = sum(wrench[:, :, p, None] * screws[:, p, None, :] for p in range(6))
        return along * mask[sites]

    receivers, sources = terms.range_receiver[1:], terms.range_source[1:]
    arriving = speeds(w.range_position[frames], receivers, receiver_share)
    return arriving - speeds(w.source_position[frames], sources, source_share)
