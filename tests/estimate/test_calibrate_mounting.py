"""Mounting and headings from a still second and motion, against the simulator's truth."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.motion.segment_names import XSENS_SEGMENTS
from mocap_jax.recording import Recording, RestHold

LOST = ("left_forearm", 1.3)
"""A sensor whose heading is another, where all others have one."""


@pytest.fixture(scope="module")
def recorded() -> Recording:
    """A person walks; boards measure orientations; nothing else than inertial data is kept."""
    options = mj.SimulationOptions(orientations=True, inertial_rate_hz=60)
    made = mj.simulate(mj.builtin_motion("walking"), profile="paper", options=options, seed=1)
    return dataclasses.replace(made, ranges=None, root=None)


@pytest.fixture(scope="module")
def true_body(recorded: Recording):
    return mj.load_body(recorded.truth.body_xml)


@pytest.fixture(scope="module")
def segments(recorded: Recording, true_body) -> dict[str, str]:
    topology = true_body.topology
    return {
        s: topology.body_names[topology.site_body[topology.site_index(s)]]
        for s in recorded.inertial
    }


def turned(recording: Recording, angles: dict[str, float]) -> Recording:
    """Headings of the sensors turned away."""
    streams = {}
    for name, stream in recording.inertial.items():
        q = Rotation.from_quat(np.array(stream.orientation), scalar_first=True)
        away = Rotation.from_euler("z", -angles.get(name, 0.0)) * q
        streams[name] = dataclasses.replace(stream, orientation=away.as_quat(scalar_first=True))
    return dataclasses.replace(recording, inertial=streams)


def apart(a: float, b: float) -> float:
    return abs(float(np.angle(np.exp(1j * (a - b)))))


@pytest.fixture(scope="module")
def angles(recorded: Recording) -> dict[str, float]:
    rng = np.random.default_rng(0)
    return {s: float(rng.uniform(-np.pi, np.pi)) for s in recorded.inertial}


@pytest.fixture(scope="module")
def own(recorded: Recording, segments, angles) -> mj.MountingCalibration:
    """Every sensor with a heading of its own, on a body without sites."""
    bare = dataclasses.replace(turned(recorded, angles), body_xml=None)
    body = mj.builtin_motion("walking").body
    return mj.calibrate_mounting(bare, body, segments, headings="own", misfits=False)


def test_own_headings_are_found_within_what_is_stated(own, angles):
    errors = {s.sensor: apart(s.heading, angles[s.sensor]) for s in own.sensors}
    assert max(errors.values()) < np.deg2rad(15), errors
    for sensor in own.sensors:
        assert errors[sensor.sensor] < 3 * sensor.heading_std < np.deg2rad(120)


def test_mountings_are_the_simulators(own, true_body):
    for sensor in own.sensors:
        quat = np.asarray(true_body.site_quat)[true_body.site_index(sensor.sensor)]
        true = Rotation.from_quat(quat, scalar_first=True)
        turn = (Rotation.from_matrix(sensor.R_segment_sensor) * true.inv()).as_rotvec()
        assert np.abs(turn[:2]).max() < np.deg2rad(1.0), "tilt is known from the pose"
        assert abs(turn[2]) < np.deg2rad(15)


def test_the_result_is_ready_to_be_solved(own, recorded):
    calibrated = own.recording
    assert calibrated.setup.provenance["mounting"].startswith("calibrated")
    assert calibrated.setup.rest is not None and calibrated.body_xml == own.body.xml
    assert {s.site for s in calibrated.setup.sensors} == set(recorded.inertial)
    assert own.to_dict()["sensors"].keys() == recorded.inertial.keys()
    assert "left_shank" in str(own)


def test_the_truth_is_told_from_the_calibrated_mounting(own, true_body):
    told = own.recording.truth.parameters
    for sensor in own.sensors:
        true = np.asarray(true_body.site_quat)[true_body.site_index(sensor.sensor)]
        turn = Rotation.from_rotvec(np.array(told[f"mounting_rotation/{sensor.sensor}"]))
        made = Rotation.from_matrix(sensor.R_segment_sensor) * turn
        assert (made.inv() * Rotation.from_quat(true, scalar_first=True)).magnitude() < 1e-9
    assert max(np.abs(told[f"mounting_rotation/{s.sensor}"]).max() for s in own.sensors) > 0.01


def test_a_sensor_with_another_heading_is_named(recorded, segments):
    one = turned(recorded, {LOST[0]: LOST[1]})
    body = mj.builtin_motion("walking").body
    found = mj.calibrate_mounting(one, body, segments, headings="common", misfits=False)
    doubted = {s.sensor for s in found.sensors if s.doubts}
    assert LOST[0] in doubted
    assert doubted <= {LOST[0], "left_hand", "left_upper_arm"}, found.findings


def test_facing_said_wrongly_is_told(recorded, segments):
    body = mj.builtin_motion("walking").body
    up = mj.Heading("pelvis", "z")
    right, wrong = (
        mj.calibrate_mounting(recorded, body, segments, facing=f, misfits=False)
        for f in (None, dataclasses.replace(up, axis=_sideways(recorded)))
    )
    assert apart(right.facing.angle, 0.0) < np.deg2rad(12)
    assert not right.remarks
    assert any("deg apart" in r for r in wrong.remarks)


def _sideways(recording: Recording) -> str:
    """An axis of the pelvis board that points to a side at rest."""
    quat = np.asarray(recording.inertial["pelvis"].orientation)[10]
    R = Rotation.from_quat(quat, scalar_first=True).as_matrix()
    k = int(np.argmax(np.abs(R[1])))
    return "xyz"[k]


def test_calibrate_to_pose_warns_of_a_wrong_heading(recorded, segments):
    body = mj.builtin_motion("walking").body
    mj.calibrate_to_pose(recorded, body, segments)  # right as it is: nothing is said
    with pytest.warns(UserWarning, match="axes of .*LowerLeg_flexion"):
        mj.calibrate_to_pose(
            recorded, body, segments, heading=mj.Heading("pelvis", _sideways(recorded))
        )


def test_times_outside_the_recording_are_refused(recorded, segments):
    body = mj.builtin_motion("walking").body
    last = recorded.interval[1]
    with pytest.raises(InputError, match=f"valid: 0.01 to {last:.2f} s"):
        mj.calibrate_mounting(recorded, body, segments, time=99.0)
    with pytest.raises(InputError, match=r"from 0\.?\d* to .*valid"):
        mj.calibrate_to_pose(recorded, body, segments, time=99.0)


def test_motion_is_no_rest(recorded, segments):
    body = mj.builtin_motion("walking").body
    with pytest.raises(InputError, match=r"nobody is still at .* the stillest is at"):
        mj.calibrate_mounting(recorded, body, segments, time=8.0)


def test_a_gap_is_no_rest(recorded, segments):
    def part(stream):
        time = np.asarray(stream.time)
        kept = (time < 0.2) | (time > 1.3)
        return jax.tree.map(lambda x: np.asarray(x)[kept], stream)

    boards = {name: part(stream) for name, stream in recorded.inertial.items()}
    holed = dataclasses.replace(recorded, inertial=boards)
    body = mj.builtin_motion("walking").body
    with pytest.raises(InputError, match=r"^nothing was measured at 0.55 to 1.05 s.* stillest is"):
        mj.calibrate_mounting(holed, body, segments, time=0.8)
    setup = dataclasses.replace(recorded.setup, rest=RestHold(0.3, 1.2))
    with pytest.raises(InputError, match=r"^declared rest hold: nothing was measured at 0.30 to"):
        mj.calibrate_mounting(dataclasses.replace(holed, setup=setup), body, segments)
    mute = {
        n: dataclasses.replace(s, gyroscope=np.full_like(s.gyroscope, np.nan))
        for n, s in boards.items()
    }
    with pytest.raises(InputError, match="give a time of a still second$"):  # which, nobody knows
        mj.calibrate_mounting(dataclasses.replace(holed, inertial=mute), body, segments, time=0.8)


@pytest.mark.parametrize(
    ("rest", "match"),
    [
        ((7.5, 8.5), r"^declared rest hold: nobody is still at 7.50 .* the stillest is at"),
        ((90.0, 91.0), r"hold, 90.00 to 91.00 s, is outside the recording, 0.01 to .* stillest"),
    ],
)
def test_a_declared_rest_in_which_somebody_moves_is_none(recorded, segments, rest, match):
    setup = dataclasses.replace(recorded.setup, rest=RestHold(*rest))
    moving = dataclasses.replace(recorded, setup=setup)
    body = mj.builtin_motion("walking").body
    with pytest.raises(InputError, match=match):
        mj.calibrate_mounting(moving, body, segments)


def test_wrong_names_are_told_with_the_valid_ones(recorded, segments):
    body = mj.builtin_motion("walking").body
    for match, change in (
        ("sensor 'nose'.*pelvis", {"segments": {"nose": "Head"}}),
        ("segment of sensor 'head'", {"segments": {"head": "Hat"}}),
        ("auto, own, common", {"segments": segments, "headings": "magnetic"}),
        ("facing: axis", {"segments": segments, "facing": mj.Heading("head", "up")}),
        ("facing: sensor 'hat'", {"segments": segments, "facing": mj.Heading("hat", "x")}),
        (
            "facing: rule 'level'; valid: horizontal, opensense",
            {"segments": segments, "facing": mj.Heading("head", "x", "level")},
        ),
    ):
        with pytest.raises(InputError, match=match):
            mj.calibrate_mounting(recorded, body, **change)


def test_segments_are_understood_by_name(recorded, true_body):
    from mocap_jax.initialise.mounting import worn_segments

    body = mj.builtin_motion("walking").body
    streams = {n: recorded.inertial["head"] for n in ("torso_imu", "L_LowArm", "Right Foot")}
    named = dataclasses.replace(recorded, inertial=streams)
    got = worn_segments(named, body)
    assert got == {"torso_imu": "T8", "L_LowArm": "LeftForeArm", "Right Foot": "RightFoot"}
    assert set(got.values()) <= set(XSENS_SEGMENTS)
    lost = dataclasses.replace(recorded, inertial={"imu_7": recorded.inertial["head"]})
    with pytest.raises(InputError, match="nothing says on which segment"):
        worn_segments(lost, body)
    assert worn_segments(recorded, true_body)["chest"] == "T8", "by its site"
