"""The minimum as a differentiable function: implicit differentiation with exact second derivatives.

At a minimum the gradient g(x; p) vanishes, so dx = -H^-1 (dg/dp) dp with the Hessian H of the cost,
all second-order terms included (the Gauss-Newton matrix errs by 0.2 to 10 %). H is never formed:
conjugate gradients on Hessian-vector products, preconditioned by the factor of the normal equations
at the solution, take a handful of iterations. The rule is a linear solve that JAX can transpose, so
forward and reverse mode, `vmap` and `jit` compose.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from mocap_jax.estimate.derivatives.objective import Bound, Point, Step, cost, moved
from mocap_jax.estimate.derivatives.preconditioner import Preconditioner
from mocap_jax.estimate.sequence.layout import Layout

# Relative residual of the linear solves, and most iterations of one.
_LINEAR_TOLERANCE, _LINEAR_ITERATIONS = 1e-12, 60
# Steps end below this RMS step, in posterior standard deviations.
_TOLERANCE, _STEPS = 1e-9, 12


Linear = Callable[[Step], Step]
"""A product with the Hessian."""


def _dot(a: Step, b: Step) -> Array:
    return (a.x * b.x).sum() + (a.z * b.z).sum()


def _plus(a: Step, scale: Array | float, b: Step) -> Step:
    return Step(a.x + scale * b.x, a.z + scale * b.z)


class _Descent(NamedTuple):
    solution: Step
    residual: Step
    direction: Step
    product: Array
    """Residual times preconditioned residual."""
    convex: Array
    """No direction so far had negative curvature."""
    iteration: Array


def conjugate_gradients(matvec: Linear, b: Step, preconditioner: Preconditioner) -> Step:
    """Solve matvec(x) = b with the factored normal equations as preconditioner."""
    zero = Step(jnp.zeros_like(b.x), jnp.zeros_like(b.z))
    first = preconditioner.solve(b)
    start = _dot(b, first)

    def unfinished(s: _Descent) -> Array:
        small = s.product <= _LINEAR_TOLERANCE**2 * start
        return s.convex & ~small & (s.iteration < _LINEAR_ITERATIONS)

    def advance(s: _Descent) -> _Descent:
        image = matvec(s.direction)
        curvature = _dot(s.direction, image)
        convex = curvature > 0
        # Along negative curvature the solution so far stands, or the first direction as it is.
        length = jnp.where(convex, s.product / curvature, jnp.where(s.iteration == 0, 1.0, 0.0))
        residual = _plus(s.residual, -length, image)
        spread = preconditioner.solve(residual)
        product = _dot(residual, spread)
        return _Descent(
            _plus(s.solution, length, s.direction), residual,
            _plus(spread, product / s.product, s.direction), product, convex, s.iteration + 1,
        )  # fmt: skip

    begin = _Descent(zero, b, first, start, jnp.asarray(True), jnp.zeros((), int))
    return jax.lax.while_loop(unfinished, advance, begin).solution


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def minimum(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point
) -> tuple[Step, Array]:
    """Step from a point nearby to the minimum, differentiable by `bound`.

    Args:
        layout: shape of the problem.
        preconditioner: the factored equations of the solution.
        bound: the problem.
        point: where to start; its derivative counts as zero.

    Returns:
        The step, and the RMS of its last part [posterior standard deviations].
    """
    return _minimum(layout, preconditioner, bound, point)


@minimum.defjvp
def _minimum_jvp(layout: Layout, primals: tuple, tangents: tuple) -> tuple:
    """dx = -H^-1 (dg/dp) dp."""
    preconditioner, bound, point = primals
    step, size = minimum(layout, preconditioner, bound, point)
    moved_gradient = _gradient_change(layout, bound, point, step, tangents[1])
    change = _linear_solve(layout, preconditioner, bound, point, step, moved_gradient)
    return (step, size), (jax.tree.map(jnp.negative, change), jnp.zeros_like(size))


def _gradient(layout: Layout, bound: Bound, point: Point, step: Step) -> Step:
    return jax.grad(lambda s: cost(layout, bound, moved(layout, point, s)))(step)


def _hessian_product(layout: Layout, bound: Bound, point: Point, step: Step) -> Linear:
    """The Hessian at a step times a direction."""
    return lambda v: jax.jvp(lambda s: _gradient(layout, bound, point, s), (step,), (v,))[1]


@partial(jax.jit, static_argnums=0)
def _minimum(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point
) -> tuple[Step, Array]:
    zero = Step(
        jnp.zeros((point.q.shape[0], layout.topology.nv), point.q.dtype),
        jnp.zeros(layout.constants, point.q.dtype),
    )
    return _descend(layout, preconditioner, bound, point, zero)


@partial(jax.jit, static_argnums=0)
def _gradient_change(layout: Layout, bound: Bound, point: Point, step: Step, change: Bound) -> Step:
    """Derivative of the gradient along a change of the problem."""
    return jax.jvp(lambda b: _gradient(layout, b, point, step), (bound,), (change,))[1]


@partial(jax.jit, static_argnums=0)
def _linear_solve(
    layout: Layout,
    preconditioner: Preconditioner,
    bound: Bound,
    point: Point,
    step: Step,
    right: Step,
) -> Step:
    """Solve H x = right with the Hessian at a step."""
    product = _hessian_product(layout, bound, point, step)
    return jax.lax.custom_linear_solve(
        product, right, lambda _, y: conjugate_gradients(product, y, preconditioner), symmetric=True
    )


class _Search(NamedTuple):
    step: Step
    size: Array
    """RMS of the last change."""
    iteration: Array


def _descend(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point, start: Step
) -> tuple[Step, Array]:
    """Minimum by Newton's method with conjugate gradients and backtracking; the last change's RMS.

    The factored equations alone would not do in place of the Hessian: for joints that only a weak
    prior holds, curvature that they leave out is several times what they have.
    """
    unknowns = start.x.size + start.z.size

    def height(step: Step) -> Array:
        return cost(layout, bound, moved(layout, point, step))

    def unfinished(s: _Search) -> Array:
        return (s.size > _TOLERANCE) & (s.iteration < _STEPS)

    def advance(s: _Search) -> _Search:
        slope = _gradient(layout, bound, point, s.step)
        product = _hessian_product(layout, bound, point, s.step)
        change = conjugate_gradients(product, slope, preconditioner)
        decrease = _dot(slope, change)
        here = height(s.step)

        def too_far(length: Array) -> Array:
            there = height(_plus(s.step, -length, change))
            # Rounding decides where the cost cannot tell the points apart.
            enough = here - 1e-4 * length * decrease + 1e-11 * jnp.abs(here)
            return ~(there <= enough) & (length > 1e-4)

        length = jax.lax.while_loop(too_far, lambda x: x / 4, jnp.ones((), here.dtype))
        size = jnp.sqrt(jnp.maximum(decrease, 0.0) / unknowns)
        return _Search(_plus(s.step, -length, change), size, s.iteration + 1)

    begin = _Search(start, jnp.asarray(jnp.inf, start.x.dtype), jnp.zeros((), int))
    end = jax.lax.while_loop(unfinished, advance, begin)
    return end.step, end.size
