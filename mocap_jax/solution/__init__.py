"""What an estimator returns."""

from mocap_jax.solution.solution import Solution, Status
from mocap_jax.solution.uncertainty import uncertainty

__all__ = ["Solution", "Status", "uncertainty"]
