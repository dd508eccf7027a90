"""The minimum as a differentiable function: implicit differentiation with exact second derivatives.

At a minimum the gradient g(x; p) vanishes, so dx = -H^-1 (dg/dp) dp with the Hessian H of the cost,
all second-order terms included (the Gauss-Newton matrix errs by 0.2 to 10 %). H is never formed:
conjugate gradients on Hessian-vector products are preconditioned by the factor of the normal
equations at the solution. The rule is a linear solve that JAX can transpose, so forward and reverse
mode, `vmap` and `jit` compose.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from mocap_jax.estimate.derivatives.newton import advance, begin, gradient, hessian
from mocap_jax.estimate.derivatives.objective import Bound, Point, Step
from mocap_jax.estimate.derivatives.preconditioner import Preconditioner
from mocap_jax.estimate.derivatives.trust_region import descend, dot
from mocap_jax.estimate.sequence.layout import Layout

# Relative residual of the linear solves, and most iterations of one.
_PRECISION, _PRODUCTS = 1e-10, 80
# A linear solve that ends with a larger residual is none.
_ACCEPTED = 1e-6
# The search for the minimum ends below this RMS distance [posterior standard deviations].
TOLERANCE = 1e-12
_STEPS = 20


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def minimum(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point,
    tolerance: Array | float,
) -> tuple[Step, Array]:  # fmt: skip
    """Step from a point nearby to the minimum, differentiable by `bound`.

    Args:
        layout: shape of the problem.
        preconditioner: the factored equations of the solution.
        bound: the problem.
        point: where to start; its derivative counts as zero.
        tolerance: RMS distance to end below [posterior standard deviations].

    Returns:
        The step, and the RMS of what is left to go [posterior standard deviations].
    """
    return _minimum(layout, preconditioner, bound, point, tolerance)


@minimum.defjvp
def _minimum_jvp(layout: Layout, primals: tuple, tangents: tuple) -> tuple:
    """dx = -H^-1 (dg/dp) dp."""
    preconditioner, bound, point, tolerance = primals
    step, size = minimum(layout, preconditioner, bound, point, tolerance)
    moved_gradient = _gradient_change(layout, bound, point, step, tangents[1])
    change = _linear_solve(layout, preconditioner, bound, point, step, moved_gradient)
    return (step, size), (jax.tree.map(jnp.negative, change), jnp.zeros_like(size))


def _minimum(
    layout: Layout, preconditioner: Preconditioner, bound: Bound, point: Point,
    tolerance: Array | float,
) -> tuple[Step, Array]:  # fmt: skip
    start = begin(layout, preconditioner, bound, point, 0.0)
    # The first step may be as long as the whole Hessian makes it; refused ones shorten the radius.
    s = start._replace(radius=10 * start.length)
    step = lambda s: advance(layout, preconditioner, bound, point, s)  # noqa: E731
    unfinished = lambda s: (s.size > tolerance) & ~s.ended & (s.iteration < _STEPS)  # noqa: E731
    if isinstance(s.length, jax.core.Tracer):
        s = jax.lax.while_loop(unfinished, step, s)
    else:
        # Outside of other transformations the compiled step serves as it is; a traced loop would
        # compile it once more.
        while unfinished(s):
            s = step(s)
    return s.step, s.size


@partial(jax.jit, static_argnums=0)
def _gradient_change(layout: Layout, bound: Bound, point: Point, step: Step, change: Bound) -> Step:
    """Derivative of the gradient along a change of the problem."""
    return jax.jvp(lambda b: gradient(layout, b, point, step), (bound,), (change,))[1]


@partial(jax.jit, static_argnums=0)
def _linear_solve(
    layout: Layout,
    preconditioner: Preconditioner,
    bound: Bound,
    point: Point,
    step: Step,
    right: Step,
) -> Step:
    """Solve H x = right with the Hessian at a step.

    Not a number where H is not positive, or the solution was not reached: no derivative is better
    than a wrong one.
    """
    product = hessian(layout, bound, point, step)

    def solve(_: object, y: Step) -> Step:
        slope = jax.tree.map(jnp.negative, y)
        found = descend(product, slope, preconditioner, jnp.inf, _PRECISION, _PRODUCTS)
        reached = found.product <= _ACCEPTED**2 * dot(y, preconditioner.solve(y))
        return jax.tree.map(lambda x: jnp.where(reached, x, jnp.nan), found.step)

    return jax.lax.custom_linear_solve(product, right, solve, symmetric=True)
