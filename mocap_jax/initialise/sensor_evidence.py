"""What a recording says about where each sensor is worn, beside what its set-up declares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax import so3
from mocap_jax.body import Body
from mocap_jax.initialise.declared_pose import declared_pose
from mocap_jax.initialise.rest_readings import rest_readings
from mocap_jax.initialise.still import Still
from mocap_jax.recording import Recording
from mocap_jax.solution.poses import segment_poses

RATE_HZ = 40.0
"""Rates and forces are averaged to this, which also quiets boards that ring on soft tissue."""
# Ranges of less confidence are left out: occluded pairs hear echoes.
_CONFIDENT = 0.5
_FEWEST_RANGES = 5
# Integrated rates are trusted over this time after the rest [s].
_SPAN = 20.0


class Evidence(NamedTuple):
    """Readings of s sensors, with what the declared set-up predicts at their sites; NaN: absent."""

    sensors: tuple[str, ...]
    segments: tuple[int, ...]
    """Body index of the segment that carries each sensor."""
    R_world_site: Float[np.ndarray, "s 3 3"]
    """At the declared rest pose."""
    gravity: float
    """[m/s^2]"""
    rest_force: Float[np.ndarray, "s 3"]
    """Mean specific force at rest [m/s^2]."""
    distance: Float[np.ndarray, "s n"]
    """Median range of each source to each sensor at rest [m]."""
    expected: Float[np.ndarray, "s n"]
    """The same at the declared pose [m]."""
    rate: Float[np.ndarray, "s t 3"]
    """Angular velocities from the end of the rest on, offset removed [rad/s], at `RATE_HZ`."""
    force: Float[np.ndarray, "s t 3"]
    """Specific forces over the same time [m/s^2]."""
    declared: bool
    """Whether the rest pose is declared (otherwise the body's reference pose stands in)."""

    @property
    def up(self) -> Float[np.ndarray, "s 3"]:
        """Measured direction of the specific force at rest, in the sensor frame."""
        return self.rest_force / np.linalg.norm(self.rest_force, axis=1, keepdims=True)

    @property
    def expected_up(self) -> Float[np.ndarray, "s 3"]:
        """Direction that the declared pose and mounting predict."""
        return self.R_world_site[:, 2]


def gather_evidence(recording: Recording, body: Body, still: Still) -> Evidence:
    """Evidence of all inertial sensors around a rest; `body` carries their sites."""
    site_of = {s.name: s.site for s in recording.setup.sensors}
    sensors = tuple(recording.inertial)
    sites = [body.site_index(site_of.get(name, name)) for name in sensors]
    readings = rest_readings(recording, still, use_root=True)
    q = declared_pose(recording.setup.rest, body)
    root = readings.root_position, readings.root_orientation
    if body.has_free_root and np.isfinite(np.concatenate(root)).all():
        q[:3], q[3:7] = root
    rotation, position = _site_poses(body, q)
    distance, expected = _distances(recording, body, still, (sensors, sites), position)
    time = np.arange(still.end, min(recording.interval[1], still.end + _SPAN), 1.0 / RATE_HZ)
    streams = list(recording.inertial.values())
    empty = np.zeros((0, len(time), 3))
    rate = [averaged(s.time, s.gyroscope, time) for s in streams]
    return Evidence(
        sensors,
        tuple(body.topology.site_body[s] for s in sites),
        rotation[sites],
        float(np.linalg.norm(np.asarray(body.gravity))),
        readings.force,
        distance,
        expected,
        np.stack(rate) - np.nan_to_num(readings.rate)[:, None] if streams else empty,
        np.stack([averaged(s.time, s.accelerometer, time) for s in streams]) if streams else empty,
        still.declared,
    )


def world_rates(evidence: Evidence, factor: Float[np.ndarray, "s"]) -> Float[np.ndarray, "s t 3"]:
    """Angular velocities in each sensor's frame at rest, by integrating the readings.

    Args:
        evidence: of the sensors.
        factor: what each gyroscope's readings are multiplied by first.
    """
    rate = np.nan_to_num(evidence.rate * factor[:, None, None])
    turn = turns(rate / RATE_HZ)
    R_rest_sensor, out = np.tile(np.eye(3), (len(rate), 1, 1)), np.empty_like(rate)
    for k in range(rate.shape[1]):
        out[:, k] = (R_rest_sensor @ rate[:, k, :, None])[..., 0]
        R_rest_sensor = R_rest_sensor @ turn[:, k]
    return out


def turns(vectors: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b 3 3"]:
    """Rotation matrices of rotation vectors."""
    flat = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()
    return flat.reshape(*vectors.shape, 3)


def _site_poses(body: Body, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """World rotations and positions of all sites at one pose."""
    R, p = segment_poses(body, q[None])
    on = np.array(body.topology.site_body, int)
    R_body_site = np.asarray(so3.quat_to_matrix(so3.quat_normalise(body.site_quat)))
    offset = (R[0][on] @ np.asarray(body.site_pos)[..., None])[..., 0]
    return R[0][on] @ R_body_site, p[0][on] + offset


def _distances(
    recording: Recording,
    body: Body,
    still: Still,
    worn: tuple[tuple[str, ...], list[int]],
    position: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Median measured and expected distances (sensors x sources)."""
    ranges, (sensors, sites) = recording.ranges, worn
    if ranges is None or not len(ranges.time):
        return np.zeros((len(sites), 0)), np.zeros((len(sites), 0))
    sources = [body.site_index(n) for n in ranges.source_names]
    offsets = position[sites].reshape(-1, 1, 3) - position[sources][None]
    measured = np.full((len(sites), len(sources)), np.nan)
    time, distance = np.asarray(ranges.time), np.asarray(ranges.distance)
    good = (time >= still.start) & (time <= still.end) & np.isfinite(distance)
    good &= np.asarray(ranges.confidence) >= _CONFIDENT
    for receiver, name in enumerate(ranges.receiver_names):
        mine = good & (np.asarray(ranges.receiver) == receiver)
        for source in range(len(sources)) if name in sensors else ():
            pair = mine & (np.asarray(ranges.source) == source)
            if pair.sum() >= _FEWEST_RANGES:
                measured[sensors.index(name), source] = np.median(distance[pair])
    return measured, np.linalg.norm(offsets, axis=-1)


def averaged(stream_time: np.ndarray, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Means over the steps that begin at `time`, interpolated over gaps; NaN without samples."""
    good = np.isfinite(np.asarray(values)).all(axis=1)
    if good.sum() < 2 or not len(time):
        return np.full((len(time), 3), np.nan)
    t, x = np.asarray(stream_time)[good], np.asarray(values)[good]
    pieces = 0.5 * (x[1:] + x[:-1]) * np.diff(t)[:, None]
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(pieces, axis=0)])
    edges = np.append(time, time[-1] + 1.0 / RATE_HZ)
    at = np.stack(
        [np.interp(edges, t, column, left=np.nan, right=np.nan) for column in total.T], axis=1
    )
    return np.diff(at, axis=0) * RATE_HZ
