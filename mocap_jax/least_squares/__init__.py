"""Nonlinear least squares on a manifold."""

from mocap_jax.least_squares.levenberg_marquardt import (
    NormalEquations,
    Outcome,
    Problem,
    Result,
    SolverOptions,
    minimise,
)

__all__ = ["NormalEquations", "Outcome", "Problem", "Result", "SolverOptions", "minimise"]
