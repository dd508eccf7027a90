"""The truth is told for the mounting and the headings that a calibration gives the recording."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.initialise import declared_pose
from mocap_jax.initialise.true_mounting import with_true_mounting
from mocap_jax.recording import NoiseFigures
from mocap_jax.simulation import Mounting, Profile, Suit

XML = """<mujoco><worldbody><body name="trunk" pos="0 0 1"><freejoint name="root"/>
<geom type="box" size=".1 .1 .1" pos="0 0 .2"/><body name="arm" pos="0 0 .3">
<joint name="elbow" axis="0 1 0"/><geom type="box" size=".05 .05 .1" pos="0 0 .2"/></body></body>
</worldbody></mujoco>"""
SUIT = Suit((
    Mounting("lower", "trunk", (0.1, 0.0, 0.1), (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0)),
    Mounting("upper", "arm", (0.0, 0.05, 0.2)),
))  # fmt: skip
SEGMENTS = {"lower": "trunk", "upper": "arm"}
TURN = 0.7
WORN = Profile(
    "worn", NoiseFigures(), white=False, detector=False, segment_length=0.05,
    mounting_rotation=0.2, mounting_slide=0.02, mounting_depth=0.01, orientation_heading=0.1,
)  # fmt: skip


@pytest.fixture(scope="module")
def recording() -> mj.Recording:
    """Boards that sit otherwise than declared, whose orientations are turned by one heading."""
    body = mj.load_body(XML)
    q = np.tile(np.asarray(body.qpos0), (60, 1))
    motion = mj.Motion("still", body, mj.Trajectory(np.arange(60) / 60, q))
    options = mj.SimulationOptions(
        rest_s=0.3, blend_s=0.4, inertial_rate_hz=60, orientations=True
    )  # fmt: skip
    made = mj.simulate(motion, profile=WORN, suit=SUIT, options=options, seed=4)
    streams, told = {}, dict(made.truth.parameters)
    for name, stream in made.inertial.items():
        away = Rotation.from_euler("z", -TURN)
        seen = away * Rotation.from_quat(np.array(stream.orientation), scalar_first=True)
        streams[name] = dataclasses.replace(stream, orientation=seen.as_quat(scalar_first=True))
        error = away * Rotation.from_rotvec(np.array(told[f"orientation_error/{name}"]))
        told[f"orientation_error/{name}"] = error.as_rotvec()
        told[f"heading/{name}"] = np.array(-TURN)
    truth = dataclasses.replace(made.truth, parameters=told)
    return dataclasses.replace(made, inertial=streams, truth=truth)


def site(body: mj.Body, name: str) -> tuple[np.ndarray, Rotation]:
    i = body.topology.site_index(name)
    quat = np.asarray(body.site_quat)[i]
    return np.asarray(body.site_pos)[i], Rotation.from_quat(quat, scalar_first=True)


def assert_told_from(body: mj.Body, recording: mj.Recording) -> None:
    """The true mounting is the nominal one of this body and what is told, as documented."""
    told, true = recording.truth.parameters, mj.load_body(recording.truth.body_xml)
    for name, segment in SEGMENTS.items():
        (place, R), (there, R_there) = site(body, name), site(true, name)
        turned = R * Rotation.from_rotvec(np.array(told[f"mounting_rotation/{name}"]))
        assert (turned.inv() * R_there).magnitude() < 1e-9
        scaled = np.asarray(told[f"segment_scale/{segment}"]) * place
        np.testing.assert_allclose(scaled + told[f"mounting_position/{name}"], there, atol=1e-12)


def test_truth_is_told_from_the_calibrated_mounting(recording) -> None:
    nominal = mj.load_body(recording.body_xml)
    assert_told_from(nominal, recording)
    q = declared_pose(recording.setup.rest, nominal)
    heading = mj.Heading("lower", "x")
    found = mj.calibrate_to_pose(recording, mj.load_body(XML), SEGMENTS, pose=q, heading=heading)
    for name in SEGMENTS:  # the mountings differ, so that the old truth would be wrong
        turn = site(nominal, name)[1].inv() * site(found.body, name)[1]
        assert turn.magnitude() > 0.05
    assert_told_from(found.body, found.recording)
    told, old = found.recording.truth.parameters, recording.truth.parameters
    for name in SEGMENTS:
        assert told[f"heading/{name}"] == pytest.approx(found.heading - TURN, abs=1e-12)
        # measured = exp(error) true, of every sample
        before, after = (
            Rotation.from_rotvec(np.array(p[f"orientation_error/{name}"])).inv()
            * Rotation.from_quat(np.array(r.inertial[name].orientation), scalar_first=True)
            for p, r in ((old, recording), (told, found.recording))
        )
        assert (before.inv() * after).magnitude().max() < 1e-9


def test_what_another_body_cannot_tell_is_left_out(recording) -> None:
    other = XML.replace('name="arm"', 'name="arm" euler="0 0 30"').replace(
        '<geom type="box" size=".1 .1 .1"',
        '<site name="lower" pos="0 0 .1"/><geom type="box" size=".1 .1 .1"',
    )
    told = with_true_mounting(recording.truth, mj.load_body(other)).parameters
    assert "mounting_rotation/lower" in told and "mounting_rotation/upper" not in told
    assert "mounting_position/upper" not in told
    assert "segment_scale/arm" in told
    kept = {k for k in recording.truth.parameters if not k.startswith("mounting_")}
    assert kept <= set(told)
    assert with_true_mounting(None, mj.load_body(other)) is None


def test_scales_follow_the_nominal_body(recording) -> None:
    """Of a body of twice the trunk they are half; of one of another shape nothing is told."""
    before = recording.truth.parameters
    larger = mj.load_body(recording.body_xml.replace('pos="0 0 .3"', 'pos="0 0 .6"'))
    told = with_true_mounting(recording.truth, larger).parameters
    half = 0.5 * np.asarray(before["segment_scale/trunk"])
    np.testing.assert_allclose(told["segment_scale/trunk"], half, rtol=1e-9)
    assert told["segment_scale/arm"] is before["segment_scale/arm"]
    bent = mj.load_body(recording.body_xml.replace('pos="0 0 .3"', 'pos="0 .1 .3"'))
    told = with_true_mounting(recording.truth, bent).parameters
    assert "segment_scale/trunk" not in told and "segment_scale/arm" in told


def test_without_scales_nominal_places_are_those_of_true_lengths(recording) -> None:
    truth, body = recording.truth, mj.load_body(recording.body_xml)
    bare = {k: v for k, v in truth.parameters.items() if not k.startswith("segment_scale/")}
    told = with_true_mounting(dataclasses.replace(truth, parameters=bare), body).parameters
    true = mj.load_body(truth.body_xml)
    for name in SEGMENTS:
        away = site(true, name)[0] - site(body, name)[0]
        np.testing.assert_allclose(told[f"mounting_position/{name}"], away, atol=1e-12)
