"""Headings and joints of two sensors from the acceleration of the joint between them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.initialise.mounting import even_grid, joint_heading, world_motion
from mocap_jax.recording import InertialStream

RATE_HZ, SECONDS = 100.0, 20.0
FIRST, SECOND = np.array([0.05, -0.03, -0.2]), np.array([0.02, 0.04, 0.15])


def smooth(rng: np.random.Generator, size: float, frequency: float = 1.2) -> np.ndarray:
    """Sums of a few sines (t, 3)."""
    time = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    out = np.zeros((len(time), 3))
    for k in range(1, 4):
        phase, amplitude = rng.uniform(0, 2 * np.pi, 3), rng.normal(size=3)
        out += amplitude * np.sin(frequency * k * time[:, None] + phase)
    return size * out


def pair(heading: float, moves: float = 0.3, noise: float = 0.0) -> list[InertialStream]:
    """Two sensors beside a joint that moves; each sensor's place follows from its own rotation.

    Accelerations are second differences of places: no formula of rotating frames is used.
    """
    rng = np.random.default_rng(3)
    time = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    joint, streams = smooth(rng, moves), []
    for way, turn in ((FIRST, 0.0), (SECOND, -heading)):
        R = Rotation.from_rotvec(smooth(rng, 0.4, 2.5))
        place = joint - R.apply(way)
        acceleration = np.gradient(np.gradient(place, 1 / RATE_HZ, axis=0), 1 / RATE_HZ, axis=0)
        force = R.inv().apply(acceleration + [0, 0, 9.81]) + noise * rng.normal(size=joint.shape)
        quat = (Rotation.from_euler("z", turn) * R).as_quat(scalar_first=True)
        streams.append(InertialStream(time, force, np.full_like(force, np.nan), quat))
    return streams


def found(streams: list[InertialStream]):
    grid = even_grid(streams)
    return joint_heading(*(world_motion(s, grid) for s in streams))


@pytest.mark.parametrize("heading", [-2.8, -0.4, 0.0, 1.7])
def test_heading_and_joint_are_found_exactly_without_noise(heading: float):
    got = found(pair(heading))
    assert np.cos(got.angle - heading) == pytest.approx(1.0, abs=2e-4)
    np.testing.assert_allclose(got.lever_arms, [FIRST, SECOND], atol=0.02)
    assert got.known and got.misfit < 0.05 * got.motion


def test_the_stated_deviation_covers_noise():
    got = found(pair(0.7, noise=1.0))
    assert abs(got.angle - 0.7) < 2 * got.std < 1.0


def test_a_joint_that_is_not_accelerated_tells_nothing():
    rng = np.random.default_rng(5)
    streams = pair(0.7, moves=0.0)
    still = []
    for s in streams:
        force = np.array([0, 0, 9.81]) + 0.2 * rng.normal(size=(len(s.time), 3))
        quat = np.tile([1.0, 0, 0, 0], (len(s.time), 1))
        still.append(InertialStream(s.time, force, s.gyroscope, quat))
    got = found(still)
    assert not got.known and got.std > np.deg2rad(40)


def test_gaps_and_sensors_without_readings():
    streams = pair(1.1)
    quat = np.array(streams[0].orientation)
    quat[300:500] = np.nan
    holed = InertialStream(streams[0].time, streams[0].accelerometer, streams[0].gyroscope, quat)
    assert found([holed, streams[1]]).angle == pytest.approx(1.1, abs=0.03)
    nothing = InertialStream(
        streams[0].time,
        np.full((len(quat), 3), np.nan),
        streams[0].gyroscope,
        streams[0].orientation,
    )
    assert world_motion(nothing, even_grid(streams)) is None
