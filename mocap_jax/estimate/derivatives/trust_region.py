"""Conjugate gradients on the Hessian, within a radius (Steihaug 1983).

The factored normal equations M precondition and measure: |x|_M is x in posterior standard
deviations. Without a radius, the same iteration solves linear equations.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from mocap_jax.estimate.derivatives.objective import Step
from mocap_jax.estimate.derivatives.preconditioner import Preconditioner

Linear = Callable[[Step], Step]
"""A product with the Hessian."""


def dot(a: Step, b: Step) -> Array:
    """Inner product."""
    return (a.x * b.x).sum() + (a.z * b.z).sum()


def plus(a: Step, scale: Array | float, b: Step) -> Step:
    """a + scale b."""
    return Step(a.x + scale * b.x, a.z + scale * b.z)


class Descent(NamedTuple):
    """A step that lowers the quadratic model, and what conjugate gradients know on the way."""

    step: Step
    decrease: Array
    """Of the model."""
    square: Array
    """|step|_M^2."""
    inside: Array
    """It lies within the radius, and no direction so far had negative curvature."""
    residual: Step
    direction: Step
    product: Array
    """Residual times preconditioned residual."""
    overlap: Array
    """step' M direction."""
    own: Array
    """direction' M direction."""
    iteration: Array


def descend(
    hessian: Linear,
    slope: Step,
    preconditioner: Preconditioner,
    radius: Array | float,
    precision: Array | float,
    most: int,
) -> Descent:
    """Lower slope' x + x' H x / 2 within |x|_M <= radius.

    Args:
        hessian: product with H.
        slope: gradient.
        preconditioner: M.
        radius: inf for the solution of H x = -slope, not a number where H is not positive.
        precision: relative residual to end at, in the norm of M^-1.
        most: products at most.
    """
    residual = Step(-slope.x, -slope.z)
    spread = preconditioner.solve(residual)
    start = dot(residual, spread)
    zero = jnp.zeros_like(start)

    def unfinished(s: Descent) -> Array:
        return s.inside & (s.product > precision**2 * start) & (s.iteration < most)

    def advance(s: Descent) -> Descent:
        image = hessian(s.direction)
        curvature = dot(s.direction, image)
        convex = curvature > 0
        full = jnp.where(convex, s.product / jnp.where(convex, curvature, 1.0), jnp.inf)
        room = s.own * (radius**2 - s.square)
        edge = (jnp.sqrt(jnp.maximum(s.overlap**2 + room, 0.0)) - s.overlap) / s.own
        length = jnp.minimum(full, edge)
        residual = plus(s.residual, -length, image)
        spread = preconditioner.solve(residual)
        product = dot(residual, spread)
        ratio = product / s.product
        return Descent(
            step=plus(s.step, length, s.direction),
            decrease=s.decrease + length * s.product - length**2 * curvature / 2,
            square=s.square + 2 * length * s.overlap + length**2 * s.own,
            inside=full < edge,
            residual=residual,
            direction=plus(spread, ratio, s.direction),
            product=product,
            overlap=ratio * (s.overlap + length * s.own),
            own=product + ratio**2 * s.own,
            iteration=s.iteration + 1,
        )

    begin = Descent(
        Step(jnp.zeros_like(slope.x), jnp.zeros_like(slope.z)), zero, zero, jnp.asarray(True),
        residual, spread, start, zero, start, jnp.zeros((), int),
    )  # fmt: skip
    return jax.lax.while_loop(unfinished, advance, begin)
