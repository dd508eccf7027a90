"""Orientations by VQF: those of a known motion, gaps, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError
from mocap_jax.initialise import check_readings, with_orientations
from mocap_jax.recording import InertialStream, MagneticStream, Recording, Setup

pytest.importorskip("vqf")
N, RATE = 2000, 100.0


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A board at rest for two seconds, then turning, in a magnetic field that points north."""
    t = np.clip(np.arange(N) / RATE - 2.0, 0.0, None)[:, None]
    turn = Rotation.from_rotvec(0.9 * np.sin(2 * np.pi * np.array([0.3, 0.43, 0.21]) * t))
    R_world_sensor = Rotation.from_rotvec([0.4, -0.3, 0.8]) * turn
    step = (R_world_sensor[:-1].inv() * R_world_sensor[1:]).as_rotvec() * RATE
    rate = np.vstack([step[:1], 0.5 * (step[1:] + step[:-1]), step[-1:]])
    time = np.arange(N) / RATE
    inverse = R_world_sensor.inv()
    board = InertialStream(time, inverse.apply([0.0, 0.0, 9.81]), rate, np.full((N, 4), np.nan))
    field = MagneticStream(time, inverse.apply([0.0, 20e-6, -40e-6]))
    read = Recording({"a": board}, None, None, {"a": field}, None, None, Setup(), None)
    return dataclasses.replace(read, subject=R_world_sensor.as_quat(scalar_first=True).tobytes())


def truth(recording: Recording) -> Rotation:
    values = np.frombuffer(recording.subject).reshape(-1, 4)
    return Rotation.from_quat(values, scalar_first=True)


def estimated(recording: Recording) -> Rotation:
    return Rotation.from_quat(recording.inertial["a"].orientation, scalar_first=True)


def test_inclination_without_a_magnetometer(recording):
    out = with_orientations(recording)
    up = lambda R: R.inv().apply([0.0, 0.0, 1.0])  # noqa: E731
    error = np.arccos(np.clip((up(estimated(out)) * up(truth(recording))).sum(1), -1, 1))
    assert np.rad2deg(error).max() < 2.0
    assert check_readings(out).ok
    facts = out.setup.provenance
    assert facts["orientation"] == "offline VQF without magnetometer: a"
    assert "not comparable" in facts["heading"]
    assert np.isnan(recording.inertial["a"].orientation).all(), "the input is left as it was"


def test_heading_with_a_magnetometer(recording):
    out = with_orientations(recording, magnetometer=True)
    error = (estimated(out).inv() * truth(recording)).magnitude()
    assert np.rad2deg(error).max() < 4.0
    assert out.setup.provenance["heading"] == "magnetic east"


def test_measured_orientations_are_kept_unless_named(recording):
    board = recording.inertial["a"]
    given = dataclasses.replace(board, orientation=np.tile([1.0, 0, 0, 0], (N, 1)))
    have = dataclasses.replace(recording, inertial={"a": given})
    assert with_orientations(have) is have
    assert not np.array_equal(
        with_orientations(have, sensors=("a",)).inertial["a"].orientation, given.orientation
    )


def test_gaps(recording):
    board = recording.inertial["a"]
    force = board.accelerometer.copy()
    force[500:510] = np.nan
    holed = dataclasses.replace(board, accelerometer=force)
    out = with_orientations(dataclasses.replace(recording, inertial={"a": holed}))
    orientation = out.inertial["a"].orientation
    assert np.isnan(orientation[500:510]).all() and not out.salvage
    assert np.isfinite(np.delete(orientation, np.arange(500, 510), 0)).all()
    force[500:600] = np.nan
    holed = dataclasses.replace(board, accelerometer=force)
    out = with_orientations(dataclasses.replace(recording, inertial={"a": holed}))
    assert len(out.salvage) == 1 and "2 pieces" in out.salvage[0]


def test_what_cannot_be_had_is_named(recording):
    board = recording.inertial["a"]
    without = dataclasses.replace(board, gyroscope=np.full((N, 3), np.nan))
    with pytest.raises(InputError, match="sensor a has no gyroscope"):
        with_orientations(dataclasses.replace(recording, inertial={"a": without}))
    with pytest.raises(InputError, match="sensor a has no magnetic field.*: none"):
        with_orientations(dataclasses.replace(recording, magnetic={}), magnetometer=True)
    with pytest.raises(InputError, match="unknown sensor 'b'; valid: a"):
        with_orientations(recording, sensors=("b",))
