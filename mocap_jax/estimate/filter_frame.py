"""One frame of the filter: the time update and the sequence of measurement updates."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float, Int

from mocap_jax import so3
from mocap_jax.body import Body
from mocap_jax.estimate.filter_tilt import tilt_update
from mocap_jax.estimate.joint_ranges import within_ranges
from mocap_jax.estimate.pose_manifold import pose_manifold
from mocap_jax.kalman import (
    Dynamics,
    Innovation,
    Process,
    SigmaPoints,
    State,
    predict,
    predict_unscented,
    update,
    update_unscented,
)
from mocap_jax.measurement import predict as readings
from mocap_jax.measurement.chain import Chain, chain, site_state
from mocap_jax.residuals.magnetic import magnetic_heading_error

# A heading so many deviations off counts half.
_DISTURBED = 3.0


class FilterModel(NamedTuple):
    """What stays fixed over the frames (hashable: static under `jit`)."""

    process: Process
    kinds: str
    """Letters of the measurements that the recording really holds, R for the root pose, V for tilts
    by boards that do not accelerate."""
    sensors: tuple[int, ...]
    """Sites of the sensors."""
    range_sites: tuple[int, ...]
    """Sites that take part in ranges."""
    range_gate: float
    range_facing: bool = True
    """Leave out ranges whose receiver is behind the source at the estimated pose."""
    sigma_points: SigmaPoints | None = None
    """Of the unscented filter; None: derivatives, as in the extended one."""
    limits: bool = False
    """Cut beliefs off at the ranges of hinges and slides."""


class Parameters(NamedTuple):
    """Numbers of the filter (traced)."""

    dynamics: Dynamics
    accelerometer_sigma: Float[Array, "s"]
    gyroscope_sigma: Float[Array, "s"]
    orientation_sigma: Float[Array, "s"]
    range_sigma: Float[Array, ""]
    root_sigma: Float[Array, "6"]
    lever_arm_sigma: Float[Array, ""]
    mounting_sigma: Float[Array, ""]
    """Remaining error of the sensors' mounting rotation [rad]."""
    speed_of_sound: Float[Array, ""]
    magnetic: Float[Array, "4"]
    """Direction of north and deviation of a heading [rad], frames that share one error, and frames
    within which headings are corrected in any case."""
    gravity: Float[Array, "4"] | tuple[()] = ()
    """The same of tilts by boards that do not accelerate: deviation [rad], both numbers of frames,
    and deviations at which a tilt counts half. Empty without a gravity reference, as the next."""


class FrameInput(NamedTuple):
    """Measurements of one frame, or of t frames stacked in front."""

    valid: Float[Array, ""]
    """False for the padding after the last frame."""
    first: Float[Array, ""]
    """True for the first frame, which has no step before it."""
    accelerometer: Float[Array, "s 3"]
    gyroscope: Float[Array, "s 3"]
    orientation: Float[Array, "s 4"]
    range_distance: Float[Array, "k"]
    range_weight: Float[Array, "k"]
    range_source: Int[Array, "k"]
    """Place in `FilterModel.range_sites`."""
    range_receiver: Int[Array, "k"]
    range_lead: Float[Array, "k"]
    """[frames]"""
    root_position: Float[Array, "3"]
    root_orientation: Float[Array, "4"]
    magnetic: Float[Array, "s 3"]
    gravity: Float[Array, "s 3"] | tuple[()] = ()
    """What boards feel that do not accelerate [m/s^2]."""


def filter_frame(
    body: Body, model: FilterModel, parameters: Parameters, state: State, frame: FrameInput
) -> tuple[State, dict[str, Innovation]]:
    """Advance the belief to a frame and take in its measurements, one kind after the other.

    The kinds run through one loop, so that the body's kinematics, linearised anew for each, are
    compiled once.
    """
    manifold = pose_manifold(body.topology)
    if model.sigma_points is None:
        moved = predict(manifold, model.process, parameters.dynamics, state)
    else:
        moved = predict_unscented(
            manifold, model.process, parameters.dynamics, state, model.sigma_points
        )
    current = _choose(frame.first, state, moved)
    branches = [_taking_in(kind, body, model, parameters, frame) for kind in model.kinds]

    def take_in(i: Array, carry: _Carry) -> _Carry:
        c = chain(body, carry[0].q, carry[0].v, carry[0].a)
        return jax.lax.switch(i, branches, c, *carry)

    if not branches:
        return _choose(frame.valid, current, state), {}
    carry = (current, _no_innovations(branches, body, current))
    current, innovations = jax.lax.fori_loop(0, len(branches), take_in, carry)
    if model.limits:
        current = within_ranges(body, current)
    return _choose(frame.valid, current, state), innovations


_Carry = tuple[State, dict[str, Innovation]]
_Branch = Callable[[Chain, State, dict[str, Innovation]], _Carry]


def _taking_in(
    kind: str, body: Body, model: FilterModel, parameters: Parameters, frame: FrameInput
) -> _Branch:
    """The update by one kind of measurement."""
    gate = model.range_gate if kind == "D" else 0.0
    manifold, terms_of = pose_manifold(body.topology), _TERMS[kind]

    def residual(state: State) -> Array:
        c = chain(body, state.q, state.v, state.a)
        return terms_of(body, model, parameters, c, state, frame)[1]

    def branch(c: Chain, state: State, innovations: dict[str, Innovation]) -> _Carry:
        terms = terms_of(body, model, parameters, c, state, frame)
        if model.sigma_points is None:
            state, innovation = update(manifold, state, *terms, gate=gate)
        else:
            state, innovation = update_unscented(
                manifold, state, residual, *terms[2:], points=model.sigma_points, gate=gate,
                columns=_DERIVATIVES[kind] * body.nv,
            )  # fmt: skip
        return state, innovations | {kind: innovation}

    return branch


def _no_innovations(branches: list[_Branch], body: Body, state: State) -> dict[str, Innovation]:
    """Zeros in the shapes of what the updates return."""
    out: dict[str, Innovation] = {}
    for branch in branches:
        shapes = jax.eval_shape(
            lambda s, branch=branch: branch(chain(body, s.q, s.v, s.a), s, {})[1], state
        )
        out |= jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    return out


def _choose(condition: Array, yes: State, no: State) -> State:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


_Terms = tuple[Array, Array, Array, Array]
"""Jacobian, residual, variance and activity of one update."""


def _orientation(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> _Terms:
    """Whole rotation of the sensors, compared in the sensor frame."""
    active = jnp.isfinite(frame.orientation).all(-1) & frame.valid
    quat = jnp.where(active[:, None], frame.orientation, jnp.array([1.0, 0, 0, 0], state.q.dtype))
    predicted = readings.orientation(body, c, model.sensors)
    R = so3.matmul3(jnp.swapaxes(predicted.value, 1, 2), so3.quat_to_matrix(quat))
    variance = p.orientation_sigma**2 + p.mounting_sigma**2
    return _vectors(so3.log(R), predicted.jacobian, variance[:, None], active[:, None])


def _rate(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> _Terms:
    active = jnp.isfinite(frame.gyroscope) & frame.valid
    predicted = readings.rate(body, c, model.sensors)
    residual = jnp.where(active, frame.gyroscope, 0.0) - predicted.value
    variance = p.gyroscope_sigma[:, None] ** 2 + _tilt_variance(p.mounting_sigma, predicted.value)
    return _vectors(residual, predicted.jacobian, variance, active)


def _specific_force(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> _Terms:
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


def _vectors(residual: Array, jacobian: Array, variance: Array, active: Array) -> _Terms:
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
) -> _Terms:
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
) -> _Terms:
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
) -> _Terms:
    force, nv = jnp.asarray(frame.gravity), body.nv
    active = jnp.isfinite(force).all(-1) & frame.valid
    predicted = readings.orientation(body, c, model.sensors)
    covariance = state.covariance[:nv, :nv]
    return tilt_update(predicted, force, active, body.gravity, jnp.asarray(p.gravity), covariance)


def _root(
    body: Body, model: FilterModel, p: Parameters, c: Chain, state: State, frame: FrameInput
) -> _Terms:
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


# Poses alone, poses and velocities, or accelerations as well are what a kind depends on.
_DERIVATIVES = {"O": 1, "R": 1, "M": 1, "V": 1, "G": 2, "A": 3, "D": 3}
_TERMS = {
    "O": _orientation,
    "G": _rate,
    "A": _specific_force,
    "D": _range,
    "M": _heading,
    "V": _tilt,
    "R": _root,
}
