"""What an estimator returns."""

from mocap_jax.solution.solution import Solution, Status

__all__ = ["Solution", "Status"]
