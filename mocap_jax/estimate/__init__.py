"""Estimators: where recordings, bodies and solvers are wired together."""

from mocap_jax.estimate.filter import ekf
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.sequence.layout import UserResidual
from mocap_jax.estimate.whole_sequence import optimise
from mocap_jax.estimate.whole_sequence_options import (
    ConstantsOptions,
    NoiseOptions,
    OptimiseOptions,
    PriorOptions,
)

__all__ = [
    "ConstantsOptions", "EkfOptions", "NoiseOptions", "OptimiseOptions", "PriorOptions",
    "UserResidual", "ekf", "optimise",
]  # fmt: skip
