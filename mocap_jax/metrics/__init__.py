"""Errors of a solution beside the truth, and whether its stated uncertainty is honest."""

from mocap_jax.metrics.align import interpolate
from mocap_jax.metrics.consistency import JointConsistency, coverage, joint_consistency, nees
from mocap_jax.metrics.error_table import ErrorTable
from mocap_jax.metrics.evaluate import evaluate
from mocap_jax.metrics.observed import observed_segments
from mocap_jax.metrics.unfolded import unfolded_angles

__all__ = [
    "ErrorTable", "JointConsistency", "coverage", "evaluate", "interpolate", "joint_consistency",
    "nees", "observed_segments", "unfolded_angles",
]  # fmt: skip
