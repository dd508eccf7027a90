"""From where the optimiser stopped to the minimum itself.

The optimiser stops some thousandths of a posterior deviation away, which is right for poses. An
implicit derivative needs the minimum. The normal equations are factored again after every step:
where joints are weakly determined, those of a few steps ago precondition badly.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax.estimate.derivatives.implicit import TOLERANCE
from mocap_jax.estimate.derivatives.newton import advance, begin
from mocap_jax.estimate.derivatives.objective import Bound, Point, moved
from mocap_jax.estimate.derivatives.preconditioner import Preconditioner, preconditioner
from mocap_jax.estimate.sequence.problem import SequenceProblem, State

# Steps at most, and the radius of the first [posterior standard deviations].
_STEPS, _RADIUS = 150, 0.5


class Found(NamedTuple):
    """Where the search ended."""

    point: Point
    preconditioner: Preconditioner
    """The factored equations there."""
    size: float
    """RMS of what is left to go [posterior standard deviations]."""
    steps: int


def search(problem: SequenceProblem, bound: Bound, state: State) -> Found:
    """The minimum of a problem near a state.

    Args:
        problem: what the optimiser solved.
        bound: the same, traced.
        state: where it stopped.
    """
    layout = problem.layout
    point, radius = Point(jnp.asarray(state.q), jax.tree.map(jnp.asarray, state.constants)), _RADIUS
    factor = _factored(problem, point)
    at = begin(layout, factor, bound, point, radius)
    for steps in range(_STEPS):
        if float(at.size) <= TOLERANCE or bool(at.ended):
            return Found(point, factor, float(at.size), steps)
        at = advance(layout, factor, bound, point, at)
        if bool(at.accepted):
            point = moved(layout, point, at.step)
            factor = _factored(problem, point)
            again = begin(layout, factor, bound, point, at.radius)
            at = again._replace(ended=at.ended)
    return Found(point, factor, float(at.size), _STEPS)


def _factored(problem: SequenceProblem, point: Point) -> Preconditioner:
    state = State(np.asarray(point.q), jax.tree.map(np.asarray, point.constants))
    equations, f = problem.factorised(state)
    return preconditioner(f, equations.border)
