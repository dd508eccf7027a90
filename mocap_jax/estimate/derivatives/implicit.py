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
_LINEAR_TOLERANCE, _LINEAR_ITERATIONS = 1e-9, 60
# Steps end below this RMS step, in posterior standard deviations.
_TOLERANCE, _STEPS = 1e-11, 60
# Earlier steps that a new one is mixed from, and the ridge of their least squares.
_MEMORY, _RIDGE = 6, 1e-14


Field = Callable[[Step], Step]
"""The gradient at a step."""
Linear = Callable[[Step], Step]
"""Its derivative along a step."""


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
    iteration: Array


def conjugate_gradients(matvec: Linear, b: Step, preconditioner: Preconditioner) -> Step:
    """Solve matvec(x) = b with the factored normal equations as preconditioner."""
    zero = Step(jnp.zeros_like(b.x), jnp.zeros_like(b.z))
    first = preconditioner.solve(b)
    start = _dot(b, first)

    def unfinished(s: _Descent) -> Array:
        small = s.product <= _LINEAR_TOLERANCE**2 * start
        return ~small & (s.iteration < _LINEAR_ITERATIONS)

    def advance(s: _Descent) -> _Descent:
        image = matvec(s.direction)
        length = s.product / _dot(s.direction, image)
        residual = _plus(s.residual, -length, image)
        spread = preconditioner.solve(residual)
        product = _dot(residual, spread)
        return _Descent(
            _plus(s.solution, length, s.direction), residual,
            _plus(spread, product / s.product, s.direction), product, s.iteration + 1,
        )  # fmt: skip

    begin = _Descent(zero, b, first, start, jnp.zeros((), int))
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


@partial(jax.jit, static_argnums=0)
def _minimum(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point
) -> tuple[Step, Array]:
    zero = Step(
        jnp.zeros((point.q.shape[0], layout.topology.nv), point.q.dtype),
        jnp.zeros(layout.constants, point.q.dtype),
    )
    return _descend(lambda step: _gradient(layout, bound, point, step), zero, preconditioner)


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

    def product(v: Step) -> Step:
        return jax.jvp(lambda s: _gradient(layout, bound, point, s), (step,), (v,))[1]

    return jax.lax.custom_linear_solve(
        product, right, lambda _, y: conjugate_gradients(product, y, preconditioner), symmetric=True
    )


class _Search(NamedTuple):
    step: Step
    size: Array
    """RMS of the last change."""
    change: Step
    """The last one, before it was mixed with earlier ones."""
    slope: Step
    steps: Step
    """Differences of the last few steps, latest first, and of their changes and slopes."""
    changes: Step
    slopes: Step
    iteration: Array


def _descend(f: Field, start: Step, preconditioner: Preconditioner) -> tuple[Step, Array]:
    """Root of a gradient f by Anderson's acceleration of x - M^-1 f(x); also the last change's RMS.

    M are the factored equations of the solution. Where they differ from the Hessian, which plain
    iteration would multiply errors by, the mixture of the last few steps makes up for it (near the
    root it is what GMRES does). Least squares in the norm of M (Walker and Ni 2011).
    """
    unknowns = start.x.size + start.z.size

    def at(step: Step) -> tuple[Step, Step, Array]:
        slope = f(step)
        change = jax.tree.map(jnp.negative, preconditioner.solve(slope))
        return change, slope, jnp.sqrt(jnp.maximum(-_dot(change, slope), 0.0) / unknowns)

    def unfinished(s: _Search) -> Array:
        return (s.size > _TOLERANCE) & (s.iteration < _STEPS)

    def advance(s: _Search) -> _Search:
        gram = -_dots(s.changes, s.slopes)
        ridge = _RIDGE * jnp.trace(gram) + jnp.finfo(gram.dtype).tiny
        right = -_dots(s.changes, jax.tree.map(lambda x: x[None], s.slope))[:, 0]
        share = jnp.linalg.solve(gram + ridge * jnp.eye(_MEMORY), right)
        mixed = jax.tree.map(
            lambda f, dx, df: f - jnp.tensordot(share, dx + df, 1), s.change, s.steps, s.changes
        )
        step = _plus(s.step, 1.0, mixed)
        change, slope, size = at(step)
        return _Search(
            step, size, change, slope, _remember(s.steps, s.step, step),
            _remember(s.changes, s.change, change), _remember(s.slopes, s.slope, slope),
            s.iteration + 1,
        )  # fmt: skip

    nothing = jax.tree.map(lambda x: jnp.zeros((_MEMORY, *x.shape), x.dtype), start)
    change, slope, size = at(start)
    begin = _Search(start, size, change, slope, nothing, nothing, nothing, jnp.zeros((), int))
    end = jax.lax.while_loop(unfinished, advance, begin)
    return end.step, end.size


def _dots(a: Step, b: Step) -> Array:
    """All products of two rows of steps."""
    return jnp.einsum("itd,jtd->ij", a.x, b.x) + a.z @ b.z.T


def _remember(rows: Step, before: Step, now: Step) -> Step:
    return jax.tree.map(lambda r, a, b: jnp.concatenate([(b - a)[None], r[:-1]]), rows, before, now)
