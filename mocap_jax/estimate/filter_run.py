"""What the filter's loops take: a recording, a body and options as arrays."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax.body import Body
from mocap_jax.body.topology import FREE, SLIDE
from mocap_jax.estimate.filter_data import filter_data
from mocap_jax.estimate.filter_model import FilterModel, FrameInput, Parameters
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.free_roots import FreeRoot, free_roots
from mocap_jax.estimate.gravity_reference import frame_gravity, gravity_figures
from mocap_jax.estimate.innovation_statistics import InnovationStatistics
from mocap_jax.estimate.magnetometers import filter_figures, frame_fields
from mocap_jax.estimate.observed_joints import observed_joints
from mocap_jax.estimate.shared_joints import shared_joints
from mocap_jax.initialise import RestEstimate
from mocap_jax.kalman import Dynamics, SigmaPoints, State, butterworth_rate, process_noise
from mocap_jax.measurement import gather
from mocap_jax.recording import Recording

_PAPER_RATE_HZ = 140.0


class FilterRun(NamedTuple):
    """Everything the loops need."""

    body: Body
    model: FilterModel
    parameters: Parameters
    start: State
    chunks: list[FrameInput]
    time: np.ndarray
    statistics: InnovationStatistics
    observed: tuple[str, ...]
    roots: tuple[FreeRoot, ...]
    """Of the people in the body."""


def prepare(
    recording: Recording, body: Body, options: EkfOptions, rest: RestEstimate, use_root: bool,
    sigma_points: SigmaPoints | None = None,
) -> FilterRun:  # fmt: skip
    """Bring a recording, a body and options to what the loops take."""
    data = gather(recording, body, kinds=options.kinds, root=use_root, rate_hz=options.rate_hz)
    magnetic = frame_fields(recording, data.sensors, np.asarray(data.time), options.kinds)
    felt = frame_gravity(recording, body, options, rest)
    chunks, kinds, range_sites = filter_data(data, magnetic, rest, options, felt)
    model = FilterModel(
        options.process,
        kinds,
        data.sites,
        range_sites,
        options.range_gate,
        options.range_facing,
        sigma_points,
        options.limits,
    )
    dtype = jnp.dtype(options.dtype)
    cast = lambda x: (  # noqa: E731
        jnp.asarray(x, dtype) if np.issubdtype(np.asarray(x).dtype, np.floating) else x
    )
    statistics = InnovationStatistics(data, body, range_sites, options.range_gate)
    return FilterRun(
        # The model's text would be part of the compilation key.
        jax.tree.map(cast, dataclasses.replace(rest.mounted(body), xml="")),
        model,
        jax.tree.map(cast, _parameters(recording, body, options, rest, float(data.step))),
        jax.tree.map(cast, _start(body, options, rest, _seen(body, rest, recording))),
        [jax.tree.map(cast, c) for c in chunks],
        np.asarray(data.time),
        statistics,
        observed_joints(body, data),
        free_roots(data, body.topology, root_given=use_root),
    )


def _parameters(
    recording: Recording, body: Body, options: EkfOptions, rest: RestEstimate, step: float
) -> Parameters:
    noise, sensors = recording.setup.noise, len(rest.sensors)
    density = jerk_density(body, options)
    density[~_seen(body, rest, recording)] = 0.0
    each = lambda sigma: jnp.full(sensors, sigma)  # noqa: E731
    # A mismatch of a tenth is what the noise of a clean recording makes.
    shown = max(rest.mismatch - 0.1, 0.0) / 0.9
    return Parameters(
        dynamics=_dynamics(body, options, rest, density, step),
        accelerometer_sigma=each(noise.accelerometer),
        gyroscope_sigma=each(noise.gyroscope),
        orientation_sigma=each(noise.orientation),
        range_sigma=jnp.hypot(noise.range, shown * options.range_model),
        root_sigma=jnp.asarray([noise.root_position] * 3 + [noise.root_orientation] * 3),
        lever_arm_sigma=jnp.hypot(options.lever_arm_sigma, shown * options.lever_arm_model),
        mounting_sigma=jnp.asarray(_remaining_mounting(rest)),
        speed_of_sound=jnp.asarray(recording.setup.speed_of_sound),
        magnetic=jnp.asarray(filter_figures(recording, body, options, rest, step)),
        gravity=gravity_figures(options.gravity, step),
    )


def _dynamics(
    body: Body, options: EkfOptions, rest: RestEstimate, density: np.ndarray, step: float
) -> Dynamics:
    h = jnp.asarray(step)
    noise = process_noise(options.process, h, jnp.asarray(density))
    if options.process != "white_jerk" or options.joint_sigma <= 0:
        return Dynamics(h, noise)
    shared = shared_joints(body, rest.sites)
    sigma = np.where(shared, options.shared_joint_sigma, options.joint_sigma)
    rate = np.array(butterworth_rate(density, sigma))
    for j, kind in enumerate(body.topology.joint_types):
        if kind in (FREE, SLIDE):
            rate[body.topology.dof_joint == j] = 0.0
    return Dynamics(h, noise, jnp.asarray(rate), jnp.asarray(rest.q))


def _seen(body: Body, rest: RestEstimate, recording: Recording) -> np.ndarray:
    """Mask (nv,): degree of freedom moves something that is measured."""
    topology = body.topology
    names = [s.site for s in recording.setup.sensors if s.name in rest.sensors]
    names += list(recording.ranges.source_names) if recording.ranges is not None else []
    bodies = [topology.site_body[topology.site_index(n)] for n in {*names, *rest.sensors}
              if n in topology.site_names]  # fmt: skip
    return topology.body_dofs[bodies].any(axis=0) | topology.body_dofs[1]


def _remaining_mounting(rest: RestEstimate) -> float:
    """Typical error of the mounting rotations after the rest hold [rad]."""
    return float(np.sqrt(np.mean(rest.mounting_std**2))) if rest.mounting_std.size else 0.0


def jerk_density(body: Body, options: EkfOptions) -> np.ndarray:
    """Spectral density of the jerk of each degree of freedom (nv,) [rad^2/s^5, m^2/s^5]."""
    topology = body.topology
    joint = options.joint_jerk_density
    if options.process != "white_jerk":
        joint = options.paper_acceleration_noise**2 * _PAPER_RATE_HZ
    density = np.full(body.nv, joint)
    for j, kind in enumerate(topology.joint_types):
        at = topology.joint_dof[j]
        if kind == FREE:
            density[at : at + 3] = options.root_translation_jerk_density
            density[at + 3 : at + 6] = options.root_rotation_jerk_density
        elif kind == SLIDE and options.process == "white_jerk":
            density[at] = options.slide_jerk_density
    return density


def _start(body: Body, options: EkfOptions, rest: RestEstimate, seen: np.ndarray) -> State:
    """Belief at the first frame. What nothing measures stays where it is, uncertain."""
    still, nv = rest.still.still, body.nv
    sigma_v = options.rest_velocity_sigma if still else options.velocity_sigma
    sigma_a = options.rest_acceleration_sigma if still else options.acceleration_sigma
    P = np.zeros((3 * nv, 3 * nv))
    P[:nv, :nv] = rest.covariance
    pose, velocity, acceleration = np.arange(3 * nv).reshape(3, nv)
    P[velocity, velocity] = np.where(seen, sigma_v, 1e-3) ** 2
    P[acceleration, acceleration] = np.where(seen, sigma_a, 1e-3) ** 2
    P[pose[~seen], pose[~seen]] = options.joint_sigma**2
    return State(jnp.asarray(rest.q), jnp.zeros(nv), jnp.zeros(nv), jnp.asarray(P))
