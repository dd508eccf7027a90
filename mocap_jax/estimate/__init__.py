"""Estimators: where recordings, bodies and solvers are wired together."""

from mocap_jax.estimate.filter import ekf
from mocap_jax.estimate.filter_options import EkfOptions

__all__ = ["EkfOptions", "ekf"]
