"""Levenberg-Marquardt and Gauss-Newton on a manifold, for block-banded problems with a border.

Knows no bodies: a problem is anything that fulfils `Problem`. Damping is of jitter (`damping.py`)
and follows the gain ratio (Nielsen 1999; Madsen, Nielsen, Tingleff 2004, algorithm 3.16).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol

import numpy as np

from mocap_jax import linalg
from mocap_jax.errors import SolveError
from mocap_jax.least_squares.damping import (
    damp_jitter,
    jitter_force,
    on_the_step,
    smooth_in_time,
)

# A rejected step multiplies the damping by this, the next one by its square, and so on. Nielsen's 2
# takes seven linearisations to cross the six decades between a loose and a tight problem.
_GROWTH = 10.0
# Relative size of the last steps of a refinement.
REFINED = 1e-9


@dataclass(frozen=True)
class NormalEquations:
    """Cost and quadratic model at a state: lower blocks of J'J, gradient J'r, border."""

    cost: float
    lower: np.ndarray
    """(t, b + 1, d, d), may be overwritten by the solver."""
    gradient: np.ndarray
    """(t, d)"""
    corner: np.ndarray | None
    """(m, m), None without constants."""
    corner_gradient: np.ndarray
    """(m,)"""
    border: linalg.BorderBlocks | None


Follow = Callable[[np.ndarray, linalg.BorderBlocks | None, int], None]
"""What a problem may call while it makes its equations: (lower, border, number of frames whose
blocks are final). The solver factors these frames meanwhile."""


class Problem(Protocol):
    """What the solver needs to know."""

    @property
    def unknowns(self) -> int: ...

    def cost(self, state: Any) -> float: ...

    def linearise(self, state: Any, follow: Follow | None = None) -> NormalEquations: ...

    def move(self, state: Any, step: np.ndarray, constants: np.ndarray) -> Any: ...

    @property
    def refines(self) -> bool:
        """Whether J'J loses digits that `model` keeps: then steps are refined with it."""
        ...

    @property
    def bends(self) -> np.ndarray:
        """Which unknowns of a frame take part in curved terms (d,): their jitter is damped."""
        ...

    @property
    def least_damping(self) -> float:
        """Damping of second differences that hardly slows convergence [1/rad^2, 1/m^2]."""
        ...

    def model(
        self, state: Any, x: np.ndarray, z: np.ndarray, *, offset: bool, damping: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """J'(r + J (x, z)) + damping (x, z), or without r where `offset` is false."""
        ...


class Outcome(Enum):
    """How the iteration ended."""

    CONVERGED = "converged"
    MAX_ITERATIONS = "max_iterations"
    STALLED = "stalled"
    SINGULAR = "singular"
    DIVERGED = "diverged"


@dataclass(frozen=True)
class SolverOptions:
    """Settings of the iteration."""

    max_iterations: int = 30
    """Largest number of linearisations."""
    tolerance: float = 2e-2
    """Converged when the RMS step is below this many posterior standard deviations (Newton
    decrement per unknown)."""
    initial_damping: float | None = None
    """Levenberg-Marquardt damping of the step's second differences at the start [1/rad^2, 1/m^2];
    0 for Gauss-Newton. None: what the problem asks for, and never less than that."""
    max_damping: float = 1e14
    """Give up (stalled) beyond this damping."""

    @property
    def gauss_newton(self) -> bool:
        """Undamped full steps."""
        return self.initial_damping == 0


@dataclass(frozen=True)
class Result:
    """Final state and history."""

    state: Any
    outcome: Outcome
    cost: tuple[float, ...]
    """Cost at the start and after each accepted step."""
    message: str = ""


def minimise(
    problem: Problem,
    state: Any,
    options: SolverOptions,
    progress: Callable[[int, float], None] | None = None,
) -> Result:
    """Minimise half the sum of squares of a problem.

    Args:
        problem: see `Problem`.
        state: where to start.
        options: settings.
        progress: called after each iteration with its number and cost.
    """
    schedule = _Schedule(options, problem.least_damping)
    costs: list[float] = []

    def result(outcome: Outcome, message: str = "") -> Result:
        return Result(state, outcome, tuple(costs), message)

    for iteration in range(options.max_iterations):
        damping = schedule.damping
        factoring = _Factoring(damping, problem.bends)
        equations = problem.linearise(state, None if problem.refines else factoring.follow)
        if not costs:
            costs.append(equations.cost)
            if not smooth_in_time(*_shape(equations)):
                schedule.forget_least()
        if not np.isfinite(equations.cost):
            return result(Outcome.DIVERGED)
        try:
            step, constants = _solve(problem, state, equations, damping, factoring)
        except SolveError as error:
            if schedule.exhausted:
                return result(Outcome.SINGULAR, str(error))
            schedule.tighten()
            del equations, factoring
            continue
        decrease = _predicted_decrease(equations, step, constants, damping, problem.bends)
        before = equations.cost
        del equations, factoring  # the next ones are as large
        candidate = problem.move(state, step, constants)
        cost = problem.cost(candidate)
        gain = (before - cost) / max(decrease, 1e-300)
        small = np.sqrt(2 * max(decrease, 0.0) / problem.unknowns) < options.tolerance
        accepted = np.isfinite(cost) and (gain > 1e-4 or options.gauss_newton)
        if accepted:
            state = candidate
            costs.append(cost)
        # A step that is small because rejections have raised its damping says nothing.
        converged = small and not schedule.raised
        if progress is not None:
            progress(iteration, costs[-1])
        if converged:
            return result(Outcome.CONVERGED)
        if accepted:
            schedule.loosen(gain)
        elif schedule.exhausted:
            return result(Outcome.STALLED)
        else:
            schedule.tighten()
    return result(Outcome.MAX_ITERATIONS)


class _Schedule:
    """The damping from step to step (Nielsen 1999)."""

    def __init__(self, options: SolverOptions, least: float) -> None:
        given = options.initial_damping
        self._options, self._growth = options, _GROWTH
        self._least = least if given is None else 0.0
        self.damping = least if given is None else given
        self.raised = False
        """Whether the last step was refused, or all of the step is damped for now."""

    @property
    def exhausted(self) -> bool:
        """Whether more damping than this is not tried."""
        too_much = self.damping * self._growth > self._options.max_damping
        return self._options.gauss_newton or too_much

    def forget_least(self) -> None:
        """Where all of the step is damped: small steps say nothing until that has gone."""
        self.raised, self._least = self._least > 0, 0.0

    def tighten(self) -> None:
        """After a step that was refused."""
        self.damping = max(self.damping * self._growth, 1e-6)
        self._growth *= _GROWTH
        self.raised = True

    def loosen(self, gain: float) -> None:
        """After a step that brought this share of the predicted decrease."""
        self.damping = max(self.damping * max(1 / 10, 1 - (2 * gain - 1) ** 3), self._least)
        self._growth = _GROWTH
        self.raised = False


class _Factoring:
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


def _solve(
    problem: Problem, state: Any, e: NormalEquations, damping: float, factoring: _Factoring
) -> tuple[np.ndarray, np.ndarray]:
    if problem.refines:
        damp_jitter(e.lower, damping * problem.bends)
        return _refined(problem, state, e, damping)
    return linalg.solve(factoring.finish(e), -e.gradient, -e.corner_gradient, e.border)


def _shape(e: NormalEquations) -> tuple[int, int]:
    """Frames and half-bandwidth."""
    return e.lower.shape[0], e.lower.shape[1] - 1


def _refined(
    problem: Problem, state: Any, e: NormalEquations, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """The step to the accuracy of J, however badly conditioned J'J is."""
    frames, band = _shape(e)
    plain = on_the_step(damping, frames, band)
    f, _ = linalg.shifted_factor(e.lower, e.corner, e.border, damping=plain)
    x, z = linalg.solve(f, -e.gradient, -e.corner_gradient, e.border)

    def model(x: np.ndarray, z: np.ndarray, *, offset: bool) -> tuple[np.ndarray, np.ndarray]:
        g, gz = problem.model(state, x, z, offset=offset, damping=plain)
        return g + jitter_force(x, damping * problem.bends, band), gz

    done = linalg.refine(f, e.border, model, x, z, tolerance=REFINED)
    return done.x, done.z


def _predicted_decrease(
    e: NormalEquations, step: np.ndarray, constants: np.ndarray, damping: float, bends: np.ndarray
) -> float:
    """Decrease of the quadratic model: half step'(damping step - gradient)."""
    slope = float((e.gradient * step).sum() + e.corner_gradient @ constants)
    frames, band = _shape(e)
    plain = on_the_step(damping, frames, band)
    length = plain * float((step * step).sum() + constants @ constants)
    jitter = float((step * jitter_force(step, damping * bends, band)).sum())
    return 0.5 * (length + jitter - slope)
