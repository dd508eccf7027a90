"""The damped step of one linearisation, and the decrease it promises."""

from __future__ import annotations

from typing import Any

import numpy as np

from mocap_jax import linalg
from mocap_jax.errors import SolveError
from mocap_jax.least_squares.damping import damp_jitter, jitter_force, on_the_step
from mocap_jax.least_squares.problem import NormalEquations, Problem

# Relative size of the last steps of a refinement.
REFINED = 1e-9
# A plain step right to this needs one correction: the next linearisation corrects what is left.
NEARLY = 1e-3


class Factoring:
    """Damps and factors equations while they are being made."""

    def __init__(self, damping: float, bends: np.ndarray) -> None:
        self._damping, self._bends = damping, bends
        self._under_way: linalg.Factoring | None = None
        self._error: SolveError | None = None

    def follow(self, lower: np.ndarray, border: linalg.BorderBlocks | None, ready: int) -> None:
        """Factor the frames before `ready`; an error is kept for `finish`."""
        if self._error is not None:
            return
        if self._under_way is None:
            plain = on_the_step(self._damping, lower.shape[0], lower.shape[1] - 1)
            self._under_way = linalg.Factoring(lower, border, damping=plain, overwrite=True)
        damp_jitter(lower, self._damping * self._bends, slice(self._under_way.done, ready))
        try:
            self._under_way.advance(ready)
        except SolveError as error:
            self._error = error

    def finish(self, e: NormalEquations) -> linalg.ArrowFactor:
        """The factor.

        Raises:
            SolveError: the equations are singular.
        """
        self.follow(e.lower, e.border, len(e.lower))
        if self._under_way is None or self._error is not None:
            raise self._error or SolveError("there are no equations")
        return self._under_way.finish(e.corner)


def solve_step(
    problem: Problem, state: Any, e: NormalEquations, damping: float, factoring: Factoring
) -> tuple[np.ndarray, np.ndarray]:
    """The damped step of the frames (t, d) and of the constants (m,).

    Raises:
        SolveError: the equations are singular.
    """
    try:
        f = factoring.finish(e)
    except SolveError:
        if not problem.refines:
            raise
        f = _positive_factor(problem, state, damping)
    if problem.refines:
        return _refined(problem, state, e, damping, f)
    return linalg.solve(f, -e.gradient, -e.corner_gradient, e.border)


def _positive_factor(problem: Problem, state: Any, damping: float) -> linalg.ArrowFactor:
    """Factor of equations that rounding has made indefinite, shifted by as little as it takes.

    The first attempt has overwritten the equations, so they are made again.
    """
    e = problem.linearise(state, None)
    damp_jitter(e.lower, damping * problem.bends)
    plain = on_the_step(damping, *shape(e))
    return linalg.shifted_factor(e.lower, e.corner, e.border, damping=plain)[0]


def shape(e: NormalEquations) -> tuple[int, int]:
    """Frames and half-bandwidth."""
    return e.lower.shape[0], e.lower.shape[1] - 1


def _refined(
    problem: Problem, state: Any, e: NormalEquations, damping: float, f: linalg.ArrowFactor
) -> tuple[np.ndarray, np.ndarray]:
    """The step to the accuracy of J, however badly conditioned J'J is."""
    frames, band = shape(e)
    plain = on_the_step(damping, frames, band)
    x, z = linalg.solve(f, -e.gradient, -e.corner_gradient, e.border)

    def model(x: np.ndarray, z: np.ndarray, *, offset: bool) -> tuple[np.ndarray, np.ndarray]:
        g, gz = problem.model(state, x, z, offset=offset, damping=plain)
        return g + jitter_force(x, damping * problem.bends, band), gz

    done = linalg.refine(f, e.border, model, x, z, tolerance=REFINED, nearly=NEARLY)
    return done.x, done.z


def predicted_decrease(
    e: NormalEquations, step: np.ndarray, constants: np.ndarray, damping: float, bends: np.ndarray
) -> float:
    """Decrease of the quadratic model: half step'(damping step - gradient)."""
    slope = float((e.gradient * step).sum() + e.corner_gradient @ constants)
    frames, band = shape(e)
    plain = on_the_step(damping, frames, band)
    length = plain * float((step * step).sum() + constants @ constants)
    jitter = float((step * jitter_force(step, damping * bends, band)).sum())
    return 0.5 * (length + jitter - slope)
