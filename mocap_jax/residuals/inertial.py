"""Inertial residuals on the frame grid: acceleration, angular rate, orientation.

Each residual is a short plain function of the poses of one sensor in a few frames, written beside
its closed-form Jacobian (tests hold the two together with `jax.jacfwd`). Perturbations of the
sensor's frame are world-frame rotation vectors w, R -> exp(w) R; those of the mounting are
sensor-frame rotation vectors m, R -> R exp(m).

Stencils: `docs/notation.md`. A plain second difference is not the acceleration at t but its
triangular mean; the weights (1, 10, 1)/12 on the measured side make both sides agree to fourth
order. Samples are means over their interval and are de-averaged first.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3

CONSISTENT = (1 / 12, 10 / 12, 1 / 12)
"""Weights of measured specific forces that match a second difference to fourth order."""
PLAIN = (0.0, 1.0, 0.0)
"""The papers' plain second difference."""


def acceleration_residual(
    position: Float[Array, "3 3"],
    rotation: Float[Array, "3 3 3"],
    force: Float[Array, "3 3"],
    bias: Float[Array, "3"],
    gravity: Float[Array, "3"],
    step: Float[Array, ""],
    weights: tuple[float, float, float] = CONSISTENT,
) -> Float[Array, "3"]:
    """Second difference of position less the measured acceleration [m/s^2], world frame.

    Args:
        position: world positions of the sensor at frames k-1, k, k+1 [m].
        rotation: R_world_sensor at the same frames.
        force: de-averaged specific forces measured there, sensor frame [m/s^2].
        bias: accelerometer bias [m/s^2].
        gravity: world frame [m/s^2].
        step: h [s].
        weights: of the three measured forces.
    """
    second = (position[0] - 2 * position[1] + position[2]) / step**2
    measured = sum(
        c * so3.matvec3(R, f - bias) for c, R, f in zip(weights, rotation, force, strict=True)
    )
    return second - measured - gravity


def rate_residual(
    rotation: Float[Array, "2 3 3"],
    mean_rate: Float[Array, "3"],
    rates: Float[Array, "2 3"],
    bias: Float[Array, "3"],
    step: Float[Array, ""],
) -> Float[Array, "3"]:
    """Rotation over one interval less the integrated rate, per step [rad/s], sensor frame.

    log(R_k' R_k+1) = h (-w_k-1 + 13 w_k + 13 w_k+1 - w_k+2)/24 + (h^2/12) w_k x w_k+1.

    Args:
        rotation: R_world_sensor at frames k and k+1.
        mean_rate: the weighted mean of the four de-averaged rates [rad/s].
        rates: de-averaged rates at k and k+1, for the coning term [rad/s].
        bias: gyroscope bias [rad/s].
        step: h [s].
    """
    turned = log_below_pi(so3.matmul3(rotation[0].T, rotation[1]))
    coning = so3.cross(rates[0] - bias, rates[1] - bias)
    return turned / step - (mean_rate - bias) - step / 12 * coning


def orientation_residual(
    rotation: Float[Array, "3 3"], measured: Float[Array, "3 3"]
) -> Float[Array, "3"]:
    """Rotation from the measured to the predicted sensor orientation [rad], sensor frame."""
    return so3.log(so3.matmul3(measured.T, rotation))


def log_below_pi(R: Float[Array, "*b 3 3"]) -> Float[Array, "*b 3"]:
    """Rotation vector of a rotation by less than half a turn (cheaper than `so3.log`)."""
    sine = 0.5 * jnp.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1
    )
    cosine = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1)
    squared = (sine * sine).sum(axis=-1)
    small = squared < 1e-8
    norm = jnp.sqrt(jnp.where(small, 1.0, squared))
    factor = jnp.where(small, 1 + squared / 6, jnp.arctan2(norm, cosine) / norm)
    return factor[..., None] * sine


class AccelerationJacobian(NamedTuple):
    """Derivative of `acceleration_residual`; that by position j is alpha_j times the identity."""

    alpha: Float[Array, "3"]
    """(1, -2, 1)/h^2 [1/s^2]."""
    turn: Float[Array, "3 *b 3"]
    """x_j: the derivative by the world rotation of frame j is skew(x_j)."""
    bias: Float[Array, "*b 3 3"]
    mounting: Float[Array, "*b 3 3"]


def acceleration_jacobian(
    rotation: tuple[Array, Array, Array],
    force: tuple[Array, Array, Array],
    step: Array,
    weights: tuple[float, float, float],
) -> AccelerationJacobian:
    """Closed-form Jacobian of `acceleration_residual`, over any batch.

    Args:
        rotation: R_world_sensor (*b, 3, 3) at frames k-1, k, k+1.
        force: bias-free specific forces (*b, 3) there.
        step: h [s].
        weights: of the three measured forces.
    """
    turn = [c * so3.matvec3(R, f) for c, R, f in zip(weights, rotation, force, strict=True)]
    bias = sum(c * R for c, R in zip(weights, rotation, strict=True))
    mounting = sum(so3.matmul3(so3.skew(x), R) for x, R in zip(turn, rotation, strict=True))
    alpha = jnp.array([1.0, -2.0, 1.0]) / step**2
    return AccelerationJacobian(alpha, jnp.stack(turn), bias, mounting)


def without_turns(jacobian: AccelerationJacobian) -> AccelerationJacobian:
    """The same where the rotations are measured ones: neither poses nor mountings change them."""
    return jacobian._replace(
        turn=jnp.zeros_like(jacobian.turn), mounting=jnp.zeros_like(jacobian.mounting)
    )


class RateJacobian(NamedTuple):
    """Derivative of `rate_residual`: +turn by the world rotation of k+1, -turn by that of k."""

    turn: Float[Array, "*b 3 3"]
    bias: Float[Array, "*b 3 3"]
    mounting: Float[Array, "*b 3 3"]


def rate_jacobian(
    rotation: tuple[Array, Array], turned: Array, rates: tuple[Array, Array], step: Array
) -> RateJacobian:
    """Closed-form Jacobian of `rate_residual`, over any batch; `turned` is log(R_k' R_k+1)."""
    inverse = so3.right_jacobian_inverse(turned)
    turn = so3.matmul3(inverse, jnp.swapaxes(rotation[1], -1, -2)) / step
    bias = jnp.eye(3, dtype=turned.dtype) - step / 12 * so3.skew(rates[1] - rates[0])
    return RateJacobian(turn, bias, so3.matmul3(turn, rotation[1] - rotation[0]))


def de_average(samples: np.ndarray) -> np.ndarray:
    """Instantaneous values from interval means, to fourth order: m - (m_-1 - 2 m + m_+1)/24.

    Args:
        samples: (t, ...), NaN where missing; next to a gap the mean itself is kept.
    """
    out = np.array(samples)
    correction = (samples[:-2] - 2 * samples[1:-1] + samples[2:]) / 24
    known = np.isfinite(correction)
    out[1:-1][known] -= correction[known]
    return out


def mean_rate(rates: np.ndarray) -> np.ndarray:
    """Weighted mean (-1, 13, 13, -1)/24 over each interval (k, k+1); last row NaN.

    Where one of the outer samples is missing, the mean of the inner two is used.
    """
    out = np.full_like(rates, np.nan)
    out[:-1] = (rates[:-1] + rates[1:]) / 2
    outer = (rates[:-3] + rates[3:] - rates[1:-2] - rates[2:-1]) / 24
    known = np.isfinite(outer)
    out[1:-2][known] -= outer[known]
    return out
