"""Derivatives of estimates by measurements, noise figures, weights, body and mountings."""

from mocap_jax.estimate.derivatives.filter_function import (
    DifferentiableFilter,
    FilterEstimate,
    FilterParameters,
    differentiable_ekf,
)
from mocap_jax.estimate.derivatives.parameters import Parameters
from mocap_jax.estimate.derivatives.sequence_function import (
    Differentiable,
    Estimate,
    differentiable,
)

__all__ = [
    "Differentiable", "DifferentiableFilter", "Estimate", "FilterEstimate", "FilterParameters",
    "Parameters", "differentiable", "differentiable_ekf",
]  # fmt: skip
