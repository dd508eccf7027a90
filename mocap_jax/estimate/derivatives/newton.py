"""Newton's method in a trust region, with the exact Hessian.

Close to the optimiser's result the cost need not be convex: joints that boards see to second order
only (neck and spine against each other) have curvature from residuals times second derivatives,
several times what the normal equations know of and of either sign. The valley there is long and
curved; a radius keeps steps to where the quadratic model holds.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from mocap_jax.estimate.derivatives.objective import Bound, Point, Step, cost, moved
from mocap_jax.estimate.derivatives.preconditioner import Preconditioner
from mocap_jax.estimate.derivatives.trust_region import Linear, descend, dot, plus
from mocap_jax.estimate.sequence.layout import Layout

# Products with the Hessian in one step, at most.
_MOST = 60
# Relative residual of a step: the distance left [posterior standard deviations], within these.
_PRECISION = (1e-6, 0.1)
# Where a step promises less than this share of the cost, rounding hides what it brings. Such steps
# come closer by several digits; one that leaves more than this share to go has met its rounding.
_ROUNDING, _LEFT = 1e-10, 0.01


class Search(NamedTuple):
    """Where the search is."""

    step: Step
    height: Array
    """Cost."""
    slope: Step
    """Gradient g."""
    length: Array
    """|g| in the norm of the preconditioner's inverse: posterior standard deviations to go."""
    radius: Array
    """Longest next step [posterior standard deviations]."""
    accepted: Array
    """The last step was taken."""
    ended: Array
    """Steps no longer come closer: what is left is rounding."""
    iteration: Array

    @property
    def size(self) -> Array:
        """RMS of what is left to go [posterior standard deviations]."""
        return self.length / jnp.sqrt(1.0 * (self.step.x.size + self.step.z.size))


def no_step(layout: Layout, point: Point) -> Step:
    """Of zero length."""
    frames, dtype = point.q.shape[0], point.q.dtype
    return Step(jnp.zeros((frames, layout.topology.nv), dtype), jnp.zeros(layout.constants, dtype))


def gradient(layout: Layout, bound: Bound, point: Point, step: Step) -> Step:
    """Of the cost, after a step."""
    return _height_and_slope(layout, bound, point, step)[1]


def hessian(layout: Layout, bound: Bound, point: Point, step: Step) -> Linear:
    """Product with the Hessian of the cost after a step."""
    return lambda v: jax.jvp(lambda s: gradient(layout, bound, point, s), (step,), (v,))[1]


@partial(jax.jit, static_argnums=0)
def begin(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point,
    radius: Array | float,
) -> Search:  # fmt: skip
    """The search at a point."""
    step = no_step(layout, point)
    height, slope = _height_and_slope(layout, bound, point, step)
    length = _length(preconditioner, slope)
    radius = jnp.asarray(radius, length.dtype)
    yes, zero = jnp.asarray(True), jnp.zeros((), int)
    return Search(step, height, slope, length, radius, yes, ~yes, zero)


def _height_and_slope(layout: Layout, bound: Bound, point: Point, step: Step) -> tuple[Array, Step]:
    return jax.value_and_grad(lambda s: cost(layout, bound, moved(layout, point, s)))(step)


def _length(preconditioner: Preconditioner, slope: Step) -> Array:
    return jnp.sqrt(jnp.maximum(dot(slope, preconditioner.solve(slope)), 0.0))


@partial(jax.jit, static_argnums=0)
def advance(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point, s: Search
) -> Search:
    """One step, or a smaller radius where it leads astray."""
    product = hessian(layout, bound, point, s.step)
    precision = jnp.clip(s.length, *_PRECISION)
    found = descend(product, s.slope, preconditioner, s.radius, precision, _MOST)
    step = plus(s.step, 1.0, found.step)
    there, slope = _height_and_slope(layout, bound, point, step)
    gain = (s.height - there) / found.decrease
    hidden = found.inside & (found.decrease < _ROUNDING * jnp.abs(s.height))
    accepted = (gain > 1e-4) | hidden
    radius = jnp.where((gain > 0.75) & ~found.inside, 2 * s.radius, s.radius)
    radius = jnp.where((gain > 0.25) | hidden, radius, jnp.sqrt(found.square) / 4)
    left = _length(preconditioner, slope)
    new = Search(
        step,
        there,
        slope,
        left,
        radius,
        accepted,
        hidden & (left > _LEFT * s.length),
        s.iteration + 1,
    )
    stay = s._replace(radius=radius, accepted=accepted, iteration=s.iteration + 1)
    return jax.tree.map(lambda a, b: jnp.where(accepted, a, b), new, stay)
