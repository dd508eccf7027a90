"""Estimators: where recordings, bodies and solvers are wired together."""

from mocap_jax.estimate.check_residual import DerivativeReport, check_residual
from mocap_jax.estimate.derivatives import differentiable, differentiable_ekf
from mocap_jax.estimate.filter import ekf
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.sequence.layout import UserResidual
from mocap_jax.estimate.single_imu import (
    SingleImuOptions,
    SingleImuSolution,
    smooth_orientation,
)
from mocap_jax.estimate.whole_sequence import optimise
from mocap_jax.estimate.whole_sequence_options import (
    ConstantsOptions,
    NoiseOptions,
    OptimiseOptions,
    PriorOptions,
)

__all__ = [
    "ConstantsOptions", "DerivativeReport", "EkfOptions", "NoiseOptions", "OptimiseOptions",
    "PriorOptions", "SingleImuOptions", "SingleImuSolution", "UserResidual", "check_residual",
    "differentiable", "differentiable_ekf", "ekf", "optimise", "smooth_orientation",
]  # fmt: skip
