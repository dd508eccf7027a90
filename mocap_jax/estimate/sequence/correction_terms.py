"""Columns of the inertial Jacobians by the constants that change a board's readings.

An acceleration residual changes by - sum_j c_j R_j df_j with the corrected readings f_j; a rate
residual by - dm - h/12 (dw_0 x w_1 + w_0 x dw_1) with the mean m and the rates w at both ends.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from mocap_jax import so3
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.corrected import slope
from mocap_jax.estimate.sequence.layout import Layout, Terms


def diagonal(x: Array) -> Array:
    """(..., 3, 3) with x (..., 3) on its diagonal."""
    return x[..., :, None] * jnp.eye(3, dtype=x.dtype)


def acceleration_columns(
    layout: Layout, rotation: Array, constants: Constants, terms: Terms, force: Array, bias: Array
) -> dict[str, Array]:
    """By kind (n-2, s, 3, columns).

    Args:
        layout: which kinds there are.
        rotation: R_world_sensor of n frames, by which forces become accelerations.
        constants: where.
        terms: readings of the frames.
        force: corrected specific forces (n, s, 3).
        bias: sum of the weighted rotations (n-2, s, 3, 3).
    """
    n = force.shape[0]
    weighted = [c * rotation[j : n - 2 + j] for j, c in enumerate(layout.force_weights)]
    cut = lambda x, j: x[j : n - 2 + j]  # noqa: E731
    gain = gain_of(constants.corrections.accelerometer_scale, layout.use_accelerometer_scale)
    out = {"accelerometer_bias": bias * gain[..., None, :]}
    if layout.use_accelerometer_scale:
        shares = gain * force
        out["accelerometer_scale"] = sum(
            R * cut(shares, j)[..., None, :] for j, R in enumerate(weighted)
        )
    if layout.use_clock_offset:
        change = gain * slope(constants, terms.force_slopes)
        late = sum(so3.matvec3(R, cut(change, j)) for j, R in enumerate(weighted))
        out["clock_offset"] = -late[..., None]
    if layout.accelerometer_steps:
        scaled = [R * gain[..., None, :] for R in weighted]
        out["accelerometer_walk"] = jnp.concatenate(
            [
                sum(cut(basis, j)[:, None, None, None] * R for j, R in enumerate(scaled))
                for basis in terms.walk[0].T
            ],
            axis=-1,
        )
    return out


def rate_columns(
    layout: Layout, constants: Constants, terms: Terms, rate: Array, mean: Array, bias: Array,
    step: Array,
) -> dict[str, Array]:  # fmt: skip
    """By kind (n-1, s, 3, columns).

    Args:
        layout: which kinds there are.
        constants: where.
        terms: readings of the frames.
        rate: corrected rates (n, s, 3).
        mean: corrected means over intervals (n-1, s, 3).
        bias: columns of the bias before scale (n-1, s, 3, 3).
        step: h [s].
    """
    before, after = rate[:-1], rate[1:]
    gain = gain_of(constants.corrections.gyroscope_scale, layout.use_gyroscope_scale)
    out = {"gyroscope_bias": bias * gain[..., None, :]}
    if layout.use_gyroscope_scale:
        turned = so3.skew(after) * before[..., None, :] - so3.skew(before) * after[..., None, :]
        out["gyroscope_scale"] = (diagonal(mean) - step / 12 * turned) * gain[..., None, :]
    if layout.use_clock_offset:
        change = gain * slope(constants, terms.rate_slopes)
        late = gain * slope(constants, terms.mean_rate_slopes)[:-1]
        coning = so3.cross(change[:-1], after) + so3.cross(before, change[1:])
        out["clock_offset"] = -(late + step / 12 * coning)[..., None]
    if layout.gyroscope_steps:
        out["gyroscope_walk"] = jnp.concatenate(
            [
                _walk_columns(basis[:, None, None, None], before, after, step) * gain[..., None, :]
                for basis in terms.walk[0].T
            ],
            axis=-1,
        )
    return out


def _walk_columns(basis: Array, before: Array, after: Array, step: Array) -> Array:
    """Columns of one step of a gyroscope's bias, before scale."""
    turned = basis[:-1] * so3.skew(after) - basis[1:] * so3.skew(before)
    middle = (basis[:-1] + basis[1:]) / 2
    return middle * jnp.eye(3, dtype=turned.dtype) - step / 12 * turned


def gain_of(scale: Array, used: bool) -> Array:
    """Change of a corrected reading by the reading, (s, 3) or (1,) where scales are certain."""
    return 1 / (1 + jnp.asarray(scale)) if used else jnp.ones(1, jnp.asarray(scale).dtype)
