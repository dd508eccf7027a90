"""Derivatives of estimates by measurements, noise figures, weights, body and mountings."""

from mocap_jax.estimate.derivatives.differentiable import Differentiable, Estimate, differentiable
from mocap_jax.estimate.derivatives.filtering import (
    DifferentiableFilter,
    FilterEstimate,
    FilterParameters,
    differentiable_ekf,
)
from mocap_jax.estimate.derivatives.parameters import Parameters

__all__ = [
    "Differentiable", "DifferentiableFilter", "Estimate", "FilterEstimate", "FilterParameters",
    "Parameters", "differentiable", "differentiable_ekf",
]  # fmt: skip
