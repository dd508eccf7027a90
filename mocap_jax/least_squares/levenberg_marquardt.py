"""Levenberg-Marquardt and Gauss-Newton on a manifold, for block-banded problems with a border.

Knows no bodies: a problem is anything that fulfils `Problem`. Damping is of jitter (`damping.py`)
and follows the gain ratio (Nielsen 1999; Madsen, Nielsen, Tingleff 2004, algorithm 3.16).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from mocap_jax.errors import SolveError
from mocap_jax.least_squares.damping import smooth_in_time
from mocap_jax.least_squares.problem import Problem
from mocap_jax.least_squares.step import Factoring, predicted_decrease, shape, solve_step

# A rejected step multiplies the damping by this, the next one by its square, and so on. Nielsen's 2
# takes seven linearisations to cross the six decades between a loose and a tight problem.
_GROWTH = 10.0


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
        trial = _try(problem, state, schedule.damping)
        if not costs:
            costs.append(trial.before)
            if not trial.smooth:
                schedule.forget_least()
        if not np.isfinite(trial.before):
            return result(Outcome.DIVERGED)
        if trial.singular:
            if schedule.exhausted:
                return result(Outcome.SINGULAR, trial.singular)
            schedule.tighten()
            continue
        accepted = np.isfinite(trial.cost) and (trial.gain > 1e-4 or options.gauss_newton)
        if accepted:
            state = trial.state
            costs.append(trial.cost)
        # A step that is small because rejections have raised its damping says nothing.
        converged = trial.size < options.tolerance and not schedule.raised
        if progress is not None:
            progress(iteration, costs[-1])
        if converged:
            return result(Outcome.CONVERGED)
        if accepted:
            schedule.loosen(trial.gain)
        elif schedule.exhausted:
            return result(Outcome.STALLED)
        else:
            schedule.tighten()
    return result(Outcome.MAX_ITERATIONS)


@dataclass(frozen=True)
class _Trial:
    """What came of one linearisation."""

    before: float
    """Cost where it was made."""
    smooth: bool
    """Whether the problem is one in time (`smooth_in_time`)."""
    state: Any = None
    """After the step."""
    cost: float = np.inf
    """There."""
    gain: float = 0.0
    """Share of the predicted decrease that came."""
    size: float = np.inf
    """RMS of the step [posterior standard deviations]."""
    singular: str = ""
    """Why there is no step."""


def _try(problem: Problem, state: Any, damping: float) -> _Trial:
    """Linearise, solve for the step, and see where it leads."""
    factoring = Factoring(damping, problem.bends)
    e = problem.linearise(state, factoring.follow)
    trial = _Trial(e.cost, smooth_in_time(*shape(e)))
    if not np.isfinite(e.cost):
        return trial
    try:
        step, constants = solve_step(problem, state, e, damping, factoring)
    except SolveError as error:
        del e, factoring  # the error's traceback would keep them, and the next ones are as large
        return replace(trial, singular=str(error))
    decrease = predicted_decrease(e, step, constants, damping, problem.bends)
    del e, factoring  # the candidate's cost needs memory too
    candidate = problem.move(state, step, constants)
    cost = problem.cost(candidate)
    gain = (trial.before - cost) / max(decrease, 1e-300)
    size = float(np.sqrt(2 * max(decrease, 0.0) / problem.unknowns))
    return replace(trial, state=candidate, cost=cost, gain=gain, size=size)


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
