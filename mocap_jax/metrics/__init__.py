"""Errors of a solution beside the truth, and whether its stated uncertainty is honest."""

from mocap_jax.metrics.align import interpolate
from mocap_jax.metrics.consistency import (
    JointConsistency,
    chi_square_band,
    coverage,
    joint_consistency,
    nees,
)
from mocap_jax.metrics.error_table import ErrorTable
from mocap_jax.metrics.evaluate import evaluate
from mocap_jax.metrics.heading_free import HeadingFreeError, heading_free_error
from mocap_jax.metrics.innovation import Nis, nis
from mocap_jax.metrics.observed import observed_segments
from mocap_jax.metrics.sparse_poser import sparse_poser_series
from mocap_jax.metrics.unfolded import unfolded_angles

__all__ = [
    "ErrorTable", "HeadingFreeError", "JointConsistency", "Nis", "chi_square_band", "coverage",
    "evaluate", "heading_free_error", "interpolate", "joint_consistency", "nees", "nis",
    "observed_segments", "sparse_poser_series", "unfolded_angles",
]  # fmt: skip
