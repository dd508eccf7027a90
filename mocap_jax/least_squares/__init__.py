"""Nonlinear least squares on a manifold."""

from mocap_jax.least_squares.levenberg_marquardt import Outcome, Result, SolverOptions, minimise
from mocap_jax.least_squares.problem import Follow, NormalEquations, Problem

__all__ = ["Follow", "NormalEquations", "Outcome", "Problem", "Result", "SolverOptions", "minimise"]
