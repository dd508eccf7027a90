"""Errors of a solution beside the truth, and whether its stated uncertainty is honest."""

from mocap_jax.metrics.align import interpolate
from mocap_jax.metrics.consistency import coverage, nees
from mocap_jax.metrics.error_table import ErrorTable
from mocap_jax.metrics.evaluate import evaluate
from mocap_jax.metrics.observed import observed_segments

__all__ = ["ErrorTable", "coverage", "evaluate", "interpolate", "nees", "observed_segments"]
