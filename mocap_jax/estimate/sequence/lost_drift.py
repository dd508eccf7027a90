"""Equations whose slowest drift is lost in rounding, factored all the same for the constants.

A free root seen through accelerations drifts slowly, and what little J'J holds of that (its
condition grows like the fourth power of the number of frames) is lost in rounding: the factor
breaks down at the last frames. A shift of the diagonal by no more than the rounding error makes it
positive definite, and holds nothing but that drift. Deviations of constants, of which drift tells
little, are too small by less than a tenth then: by 1 % at 2000 frames, where there is a plain
factor, with the largest shift allowed here; at 4000 the smallest and the largest differ by 9 %.
"""

from __future__ import annotations

from mocap_jax import linalg
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.least_squares import NormalEquations

# Shifts tried, ten times each other, in units of the largest diagonal element's rounding error.
_LEAST, _ATTEMPTS = 0.01, 3


def factorised_without_drift(
    problem: SequenceProblem, state: State
) -> tuple[NormalEquations, linalg.ArrowFactor]:
    """As `problem.factorised`, shifted by as little as rounding asks for.

    Raises:
        SolveError: more than rounding is missing.
    """
    e = problem.linearise(state)
    f, _ = linalg.shifted_factor(e.lower, e.corner, e.border, attempts=_ATTEMPTS, least=_LEAST)
    return e, f
