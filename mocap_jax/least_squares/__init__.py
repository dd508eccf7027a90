"""Nonlinear least squares on a manifold."""

from mocap_jax.least_squares.levenberg_marquardt import (
    Follow,
    NormalEquations,
    Outcome,
    Problem,
    Result,
    SolverOptions,
    minimise,
)

__all__ = ["Follow", "NormalEquations", "Outcome", "Problem", "Result", "SolverOptions", "minimise"]
