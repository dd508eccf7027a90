"""What a whole-sequence solve states as the covariance of poses and constants."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from mocap_jax import linalg
from mocap_jax.errors import SolveError
from mocap_jax.estimate.sequence.levels import Levels, mostly_wrong, prior_counts
from mocap_jax.estimate.sequence.lost_drift import factorised_without_drift
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.least_squares import NormalEquations

Factorise = Callable[[State], tuple[NormalEquations, linalg.ArrowFactor]]


@dataclass(frozen=True)
class StatedCovariance:
    """The covariance of a solve that has ended.

    Where model errors repeat with the motion, priors of constants and of the rest pose count
    `repeats` times in the solve. What is stated is rather that the data say that much less of
    constants, which vary by the root of it more, and that the rest pose is known as declared.
    """

    problem: SequenceProblem
    built: Built
    levels: Levels
    repeats: float
    rest_information: Callable[[State], np.ndarray]
    """Inverse variances of the rest pose, counted once, at a state."""

    def of_all(
        self, state: State, options: OptimiseOptions
    ) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray | None]:
        """Of poses and of neighbouring poses, as wanted, and of the constants.

        Raises:
            SolveError: the equations are singular.
        """
        equations, f = self._equations(state, self.problem.factorised)
        constants = linalg.corner_covariance(f) if self.built.layout.use_border else None
        if not options.covariance:
            return None, None, constants
        if not options.pair_covariance:
            return linalg.marginals(f, equations.border), None, constants
        return *linalg.pair_marginals(f, equations.border), constants

    def of_constants_alone(self, state: State) -> np.ndarray | None:
        """Of them where rounding has lost a free root's drift; None where more is lost."""
        if not (self.problem.refines and self.built.layout.use_border):
            return None
        try:
            without_drift = partial(factorised_without_drift, self.problem)
            return linalg.corner_covariance(self._equations(state, without_drift)[1])
        except SolveError:
            return None

    def _equations(
        self, state: State, factorised: Factorise
    ) -> tuple[NormalEquations, linalg.ArrowFactor]:
        """Equations and factor whose inverse is stated."""
        equations, f = factorised(state)
        if not self.built.layout.use_border:
            return equations, f
        counts = prior_counts(self.levels, self.built, self.repeats, last=True)
        corner = f.corner / np.sqrt(counts)
        if (
            self.repeats > 1
            and len(self.built.rest_frames)
            and mostly_wrong(self.levels, self.built)
        ):
            counted = self.problem.terms.reference_information
            self.problem.replace_terms(reference_information=self.rest_information(state))
            try:
                equations, f = factorised(state)
            finally:
                self.problem.replace_terms(reference_information=counted)
        return equations, dataclasses.replace(f, corner=corner)
