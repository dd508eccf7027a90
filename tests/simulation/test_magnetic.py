"""Simulated magnetometers against C MuJoCo's orientations and closed forms."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.body import load_body
from mocap_jax.motion import Motion
from mocap_jax.simulation import PROFILES, Mounting, SimulationOptions, Suit, earth_field

BODY = """<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint/><geom size=".1"/>
<body name="Head" pos="0 0 .5"><joint name="neck" axis="0 0 1"/><geom size=".1"/></body></body>
</worldbody></mujoco>"""
FIELD = earth_field(np.radians(50.0))


def recorded(profile: mj.simulation.Profile | str, field=FIELD) -> mj.Recording:
    body = load_body(BODY)
    time = np.arange(121) / 60.0
    q = np.tile(np.asarray(body.qpos0), (len(time), 1))
    q[:, 7] = 0.8 * np.sin(2.0 * time)
    suit = Suit((Mounting("head", "Head", (0.1, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5)),))
    options = SimulationOptions(
        rest_s=0.5, blend_s=0.3, inertial_rate_hz=60.0, magnetic_field=field
    )
    return mj.simulate(
        Motion("nod", body, mj.Trajectory(time, q, None)), profile=profile, suit=suit,
        options=options, seed=3,
    )  # fmt: skip


def true_rotations(recording: mj.Recording) -> np.ndarray:
    assert recording.truth is not None
    model = mujoco.MjModel.from_xml_string(recording.truth.body_xml)
    data, out = mujoco.MjData(model), []
    for q in np.asarray(recording.truth.trajectory.q):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        out.append(data.site("head").xmat.reshape(3, 3).copy())
    return np.array(out)


def test_the_earth_is_a_dipole() -> None:
    north, east, up = earth_field(0.0)
    assert (east, up) == (0.0, 0.0) and north == pytest.approx(2.97e-5)
    assert earth_field(np.pi / 2)[2] == pytest.approx(-5.94e-5)
    assert np.arctan2(-FIELD[2], FIELD[0]) == pytest.approx(np.arctan(2 * np.tan(np.radians(50))))


def test_ideal_readings_are_the_turned_field() -> None:
    recording = recorded("ideal")
    stream = recording.magnetic["head"]
    np.testing.assert_allclose(stream.time, recording.truth.trajectory.time)
    want = np.einsum("nji,j->ni", true_rotations(recording), FIELD)
    np.testing.assert_allclose(stream.field, want, atol=1e-12)


def test_errors_are_those_of_the_truth() -> None:
    """Without white noise, what the truth states explains the reading."""
    quiet = dataclasses.replace(
        PROFILES["ideal"], magnetic_bias=2e-6, magnetic_disturbance=3e-6, name="magnetic"
    )
    recording = recorded(quiet)
    facts = recording.truth.parameters
    there = np.array(FIELD) + facts["magnetic_disturbance/head"]
    want = np.einsum("nji,nj->ni", true_rotations(recording), there) + facts["hard_iron/head"]
    np.testing.assert_allclose(recording.magnetic["head"].field, want, atol=1e-12)
    assert np.abs(facts["hard_iron/head"]).max() > 1e-7
    slow = np.asarray(facts["magnetic_disturbance/head"])
    assert 0.5e-6 < slow.std() < 9e-6 and np.abs(np.diff(slow, axis=0)).max() < 2e-6


def test_without_a_field_there_are_no_magnetometers() -> None:
    recording = recorded("ideal", field=None)
    assert recording.magnetic == {}
