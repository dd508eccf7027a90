"""The cost of a whole sequence as one traced function, chunk by chunk.

It is the cost that the solver minimises; here JAX can differentiate it as often as it likes and by
anything. Chunks are recomputed in the backward pass, so that memory grows with the poses only.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, retract
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.layout import (
    Layout,
    Terms,
    Weights,
    by_field,
    frame_axis,
    repeats_at_ends,
)
from mocap_jax.estimate.sequence.model_gradient import moved_constants, parts


class Bound(NamedTuple):
    """A problem with all its numbers."""

    body: Body
    terms: Terms
    weights: Weights
    prior_information: Float[Array, "m"]
    readings: tuple[Float[Array, "m"], Float[Array, "m"]]


class Point(NamedTuple):
    """Where steps are taken from."""

    q: Float[Array, "t nq"]
    constants: Constants


class Step(NamedTuple):
    """Unknowns, in the tangent space at a point."""

    x: Float[Array, "t nv"]
    z: Float[Array, "m"]


def moved(layout: Layout, point: Point, step: Step) -> Point:
    """The point after a step."""
    q = jax.vmap(lambda a, b: retract(layout.topology, a, b))(point.q, step.x)
    if not layout.use_border:
        return Point(q, point.constants)
    return Point(q, moved_constants(layout, point.constants, step.z))


def cost(layout: Layout, bound: Bound, point: Point) -> Float[Array, ""]:
    """Half the sum of robust squared whitened residuals, priors included."""
    frames, halo = point.q.shape[0], layout.halo
    chunks = -(-frames // layout.chunk)
    tail = chunks * layout.chunk - frames + halo
    q = jnp.pad(point.q, ((halo, tail), (0, 0)), mode="edge")
    terms = _padded(bound.terms, halo, tail)

    @jax.checkpoint
    def of_chunk(first: Array, body: Body, q: Array, constants: Constants, terms: Terms) -> Array:
        length = layout.chunk + 2 * halo
        rows = jax.lax.dynamic_slice_in_dim(q, first, length, 0)
        found = parts(layout, body, rows, constants, _cut(terms, first, length), bound.weights)
        return sum((part.cost for part in found), jnp.zeros(()))

    def add(total: Array, first: Array) -> tuple[Array, None]:
        return total + of_chunk(first, bound.body, q, point.constants, terms), None

    starts = jnp.arange(chunks) * layout.chunk
    total, _ = jax.lax.scan(add, jnp.zeros((), point.q.dtype), starts)
    return total + (_prior(bound, point.constants) if layout.use_border else 0.0)


def _prior(bound: Bound, constants: Constants) -> Array:
    values, (read, sure) = constant_vector(constants), bound.readings
    return 0.5 * (bound.prior_information * values**2 + sure * (values - read) ** 2).sum()


def constant_vector(c: Constants) -> Float[Array, "m"]:
    """All constants in their order (see `problem.constant_values`), traced."""
    sensors = jnp.concatenate(
        [c.gyroscope_bias, c.accelerometer_bias, so3.log(c.mounting), c.offset], axis=1
    )
    g = c.geometry
    ends = (sensors, g.length, g.source, g.sound, g.range_offset)
    return jnp.concatenate([jnp.ravel(x) for x in ends])


def _padded(terms: Terms, front: int, tail: int) -> Terms:
    def pad(name: str, x: Array) -> Array:
        widths = [(0, 0)] * x.ndim
        widths[frame_axis(name)] = (front, tail)
        return jnp.pad(x, widths, mode="edge" if repeats_at_ends(name) else "constant")

    return by_field(terms, pad)


def _cut(terms: Terms, first: Array, length: int) -> Terms:
    return by_field(
        terms,
        lambda name, x: jax.lax.dynamic_slice_in_dim(x, first, length, frame_axis(name)),
    )
