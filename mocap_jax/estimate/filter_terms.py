"""What each kind of measurement says of one frame: the terms of the filter's updates."""

from __future__ import annotations

from collections.abc import Callable

import jax.numpy as jnp
from jax import Array

from mocap_jax import so3
from mocap_jax.body import Body
from mocap_jax.estimate.filter_model import FilterModel, FrameInput, Parameters
from mocap_jax.estimate.filter_tilt import tilt_update
from mocap_jax.kalman import State
from mocap_jax.measurement import predict as readings
from mocap_jax.measurement.chain import Chain, site_state
from mocap_jax.residuals.magnetic import magnetic_heading_error

# A heading so many deviations off counts half.
_DISTURBED = 3.0

UpdateTerms = tuple[Array, Array, Array, Array]
"""Jacobian, residual, variance and activity of one update."""


def _orientation(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> UpdateTerms:
    """Whole rotation of the sensors, compared in the sensor frame."""
    active = jnp.isfinite(frame.orientation).all(-1) & frame.valid
    quat = jnp.where(active[:, None], frame.orientation, jnp.array([1.0, 0, 0, 0], state.q.dtype))
    predicted = readings.orientation(body, c, model.sensors)
    R = so3.matmul3(jnp.swapaxes(predicted.value, 1, 2), so3.quat_to_matrix(quat))
    variance = p.orientation_sigma**2 + p.mounting_sigma**2
    return _vectors(so3.log(R), predicted.jacobian, variance[:, None], active[:, None])


def _rate(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> UpdateTerms:
    active = jnp.isfinite(frame.gyroscope) & frame.valid
    predicted = readings.rate(body, c, model.sensors)
    residual = jnp.where(active, frame.gyroscope, 0.0) - predicted.value
    variance = p.gyroscope_sigma[:, None] ** 2 + _tilt_variance(p.mounting_sigma, predicted.value)
    return _vectors(residual, predicted.jacobian, variance, active)


def _specific_force(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> UpdateTerms:
    active = jnp.isfinite(frame.accelerometer) & frame.valid
    predicted = readings.specific_force(body, c, model.sensors)
    residual = jnp.where(active, frame.accelerometer, 0.0) - predicted.value
    motion = site_state(body, c, model.sensors)
    spin = (motion.rate**2).sum(-1) ** 2 + (motion.rate_change**2).sum(-1)
    variance = p.accelerometer_sigma**2 + p.lever_arm_sigma**2 * spin
    variance = variance[:, None] + _tilt_variance(p.mounting_sigma, predicted.value)
    return _vectors(residual, predicted.jacobian, variance, active)


def _tilt_variance(sigma: Array, x: Array) -> Array:
    """Variance per axis of a vector seen from a frame turned by an unknown small rotation."""
    return sigma**2 * ((x * x).sum(-1, keepdims=True) - x * x)


def _vectors(residual: Array, jacobian: Array, variance: Array, active: Array) -> UpdateTerms:
    shape = residual.shape
    spread = lambda x: jnp.broadcast_to(x, shape).reshape(-1)  # noqa: E731
    return (
        jacobian.reshape(-1, jacobian.shape[-1]),
        residual.reshape(-1),
        spread(variance),
        spread(active),
    )


def _range(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> UpdateTerms:
    """Ranges of the interval before the frame; a receiver behind its source may count as absent."""
    heard = (frame.range_weight > 0) & jnp.isfinite(frame.range_distance) & frame.valid
    measured = jnp.where(heard, frame.range_distance, 1.0)
    predicted = readings.distance(
        body,
        c,
        model.range_sites,
        frame.range_source,
        frame.range_receiver,
        frame.range_lead * p.dynamics.step,
        measured / p.speed_of_sound,
    )
    active = heard & (predicted.cosine > 0) if model.range_facing else heard
    sigma = p.range_sigma / jnp.where(heard, frame.range_weight, 1.0)
    return predicted.jacobian, measured - predicted.value, sigma**2, active


def _heading(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> UpdateTerms:
    """Headings by magnetometers, robustly: errors last, and disturbed ones are far off.

    Only turns about the vertical follow from them: where the field is steep, an error of tilt looks
    like one of heading, and must not be made up for by more tilt. The belief does not know that
    biases of rates drift, and headings with them: taken at its word it would hardly be corrected,
    so that the variance is held to what corrects it in time.
    """
    active = jnp.isfinite(frame.magnetic).all(-1) & frame.valid
    reading = jnp.where(active[:, None], frame.magnetic, jnp.array([1.0, 0, 0], state.q.dtype))
    predicted = readings.orientation(body, c, model.sensors)
    north, sigma, shared, pull = p.magnetic
    error = magnetic_heading_error(predicted.value, reading, north)
    slope = (predicted.value[:, 2, :, None] * predicted.jacobian).sum(1)
    doubt = 1 + (error / (_DISTURBED * sigma)) ** 2
    believed = ((slope @ state.covariance[: slope.shape[1], : slope.shape[1]]) * slope).sum(-1)
    in_time = len(model.sensors) * pull * believed
    return slope, -error, jnp.minimum(shared * sigma**2, in_time) * doubt, active


def _tilt(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> UpdateTerms:
    force, nv = jnp.asarray(frame.gravity), body.nv
    active = jnp.isfinite(force).all(-1) & frame.valid
    predicted = readings.orientation(body, c, model.sensors)
    covariance = state.covariance[:nv, :nv]
    return tilt_update(predicted, force, active, body.gravity, jnp.asarray(p.gravity), covariance)


def _root(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> UpdateTerms:
    """Externally measured pose of the root body."""
    R, position, jacobian = readings.root_pose(body, state.q)
    seen = jnp.isfinite(frame.root_position) & frame.valid
    turned = jnp.isfinite(frame.root_orientation).all() & frame.valid
    quat = jnp.where(turned, frame.root_orientation, jnp.array([1.0, 0, 0, 0], state.q.dtype))
    residual = jnp.concatenate([
        jnp.where(seen, frame.root_position, 0.0) - position,
        so3.log(R.T @ so3.quat_to_matrix(quat)),
    ])  # fmt: skip
    active = jnp.concatenate([seen, jnp.broadcast_to(turned, (3,))])
    return jacobian, residual, p.root_sigma**2, active


DERIVATIVES = {"O": 1, "R": 1, "M": 1, "V": 1, "G": 2, "A": 3, "D": 3}
"""What a kind depends on: poses alone, poses and velocities, or accelerations as well."""
TERMS: dict[str, Callable[..., UpdateTerms]] = {
    "O": _orientation,
    "G": _rate,
    "A": _specific_force,
    "D": _range,
    "M": _heading,
    "V": _tilt,
    "R": _root,
}
"""By the letters of `FilterModel.kinds`."""
