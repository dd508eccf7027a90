"""What an estimator returns."""

from mocap_jax.solution.determination import (
    Determination,
    determination,
    determination_remark,
    stated_determination,
)
from mocap_jax.solution.solution import Solution, Status
from mocap_jax.solution.uncertainty import uncertainty

__all__ = [
    "Determination", "Solution", "Status", "determination", "determination_remark",
    "stated_determination", "uncertainty",
]  # fmt: skip
