"""`convert`: files to recordings on bodies, with what seems wrong told."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from known_motion import known, same_rotations
from mvnx_files import SEGMENTS, document
from scipy.spatial.transform import Rotation
from xsens_files import write as write_xsens

import mocap_jax as mj
from mocap_jax.body import load_body
from mocap_jax.conversion import ConvertOptions, convert, converted
from mocap_jax.errors import InputError
from mocap_jax.io import validate_recording
from mocap_jax.solution.poses import segment_poses

MAPPING = """
[[sensors]]
id = "00B4AAAA"
segment = "Pelvis"
position = [0.0, 0.0, 0.05]
orientation = [0.6, 0.8, 0.0, 0.0]
[[sensors]]
id = "00B4BBBB"
segment = "T8"
name = "chest"
"""
BODY = """<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint name="root"/>
<geom type="box" size=".1 .1 .1"/><body name="T8" pos="0 0 .1"><joint name="T8" type="ball"/>
<geom type="box" size=".1 .1 .2"/></body></body></worldbody></mujoco>"""


@pytest.fixture
def folder(tmp_path):
    write_xsens(tmp_path, known(600, seed=1), "00B4AAAA")
    write_xsens(tmp_path, known(600, seed=2), "00B4BBBB")
    (tmp_path / "map.toml").write_text(MAPPING)
    (tmp_path / "body.xml").write_text(BODY)
    return tmp_path


def test_public_names():
    assert mj.convert is convert and mj.ConvertOptions is ConvertOptions
    assert callable(mj.with_orientations) and callable(mj.check_readings)


def test_without_a_body(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        recording = convert(folder, mapping=folder / "map.toml")
    assert list(recording.inertial) == ["Pelvis", "chest"] and recording.body_xml is None
    facts = recording.setup.provenance
    assert facts["source_format"] == "xsens-mt" and facts["sensor/chest"] == "00B4BBBB"


def test_on_a_body_where_the_mapping_says(folder):
    body = folder / "body.xml"
    result = converted(folder, mapping=folder / "map.toml", body=body)
    recording = result.recording
    validate_recording(recording)
    carrier = load_body(recording.body_xml)
    site = carrier.site_index("Pelvis")
    np.testing.assert_allclose(carrier.site_pos[site], [0, 0, 0.05])
    np.testing.assert_allclose(carrier.site_quat[site], [0.6, 0.8, 0, 0])
    names = carrier.topology.body_names
    assert names[carrier.topology.site_body[carrier.site_index("chest")]] == "T8"
    assert recording.setup.provenance["mounting"] == "nominal, not calibrated: chest"
    assert any("yet to be aligned" in text for text in result.remarks)


def test_round_trip_through_a_file(folder):
    recording = convert(folder, mapping=folder / "map.toml")
    mj.write_recording(folder / "a.mcap", recording)
    read = mj.read_recording(folder / "a.mcap")
    assert read.setup == recording.setup and read.body_xml is None
    for name, stream in recording.inertial.items():
        np.testing.assert_array_equal(read.inertial[name].accelerometer, stream.accelerometer)


def test_findings_are_warnings_with_the_options_that_help_and_errors_when_strict(folder):
    wrong = ConvertOptions(quaternion_direction="world-to-sensor")
    with pytest.warns(UserWarning, match=r"look like world-to-sensor.* Option: "
                      r"--quaternion-direction sensor-to-world\.$"):  # fmt: skip
        convert(folder, mapping=folder / "map.toml", options=wrong)
    strict = ConvertOptions(quaternion_direction="world-to-sensor", strict=True)
    with pytest.raises(InputError, match="look like world-to-sensor"):
        convert(folder, mapping=folder / "map.toml", options=strict)


def test_removed_gravity_is_found_and_brought_back(tmp_path):
    motion = known(600)
    gravity = motion.matrices[:, 2] * 9.80665  # up, in the sensor's frame
    free = dataclasses.replace(motion, force=motion.force - gravity)
    write_xsens(tmp_path, free, "00B4AAAA")
    findings = converted(tmp_path).findings
    assert any("gravity seems to be removed" in f and "--acceleration" in f for f in findings)
    result = converted(tmp_path, options=ConvertOptions(acceleration="free-sensor"))
    assert not result.findings
    stream = result.recording.inertial["00B4AAAA"]
    np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)


def test_sensors_that_the_mapping_does_not_name_are_left_out_and_said(folder):
    (folder / "map.csv").write_text("id,segment\n00B4AAAA,Pelvis\n")
    result = converted(folder, mapping=folder / "map.csv")
    assert list(result.recording.inertial) == ["Pelvis"]
    assert result.remarks == ("Sensors that the mapping does not name are left out: 00B4BBBB.",)


def test_wrong_segments_and_choices_name_the_valid_ones(folder):
    (folder / "map.csv").write_text("id,segment\n00B4AAAA,LeftFoot\n")
    with pytest.raises(InputError, match="unknown segment 'LeftFoot'; valid: Pelvis, T8"):
        convert(folder, mapping=folder / "map.csv", body=folder / "body.xml")
    with pytest.raises(InputError, match="unknown segment '00B4AAAA'; valid: Pelvis, T8"):
        convert(folder, body=folder / "body.xml")
    with pytest.raises(InputError, match="unknown estimator 'kalman'; valid: vqf"):
        ConvertOptions(orientation="kalman")
    with pytest.raises(InputError, match="unknown gyroscope unit 'dps'"):
        convert(folder, options=ConvertOptions(gyroscope_unit="dps"))


def test_orientations_by_vqf(tmp_path):
    pytest.importorskip("vqf")
    motion = known(3200, 400.0)
    write_xsens(tmp_path, motion, "00B4AAAA", columns=("Acc", "Gyr"), rate="400.0Hz")
    recording = convert(tmp_path, options=ConvertOptions(orientation="vqf"))
    stream = recording.inertial["00B4AAAA"]
    up = Rotation.from_quat(stream.orientation, scalar_first=True).inv().apply([0, 0, 1.0])
    true = motion.matrices[:, 2]
    assert np.rad2deg(np.arccos(np.clip((up * true).sum(1), -1, 1))).max() < 6.0
    assert "VQF" in recording.setup.provenance["orientation"]


def test_measured_orientations_are_kept_and_that_is_said(folder):
    pytest.importorskip("vqf")
    result = converted(folder, options=ConvertOptions(orientation="vqf"))
    assert "All sensors measure orientation: none was estimated." in result.remarks
    assert "orientation" not in result.recording.setup.provenance


def test_mvn_character_carries_the_segment_poses(tmp_path):
    file = tmp_path / "a.mvnx"
    file.write_text(document())
    result = converted(file, body="mvn")
    recording = result.recording
    validate_recording(recording)
    assert recording.truth is not None
    carrier = load_body(recording.truth.body_xml)
    assert carrier.topology.body_names[1:] == SEGMENTS
    q = np.asarray(recording.truth.trajectory.q)
    rotations, positions = segment_poses(carrier, q[:3])
    offsets = np.arange(3 * len(SEGMENTS)).reshape(-1, 3) / 10
    for k in range(3):
        np.testing.assert_allclose(positions[k][1:], offsets + k, atol=1e-9)
        np.testing.assert_allclose(rotations[k][1:], np.tile(np.eye(3), (6, 1, 1)), atol=1e-9)


def test_bodies_that_cannot_carry_segment_poses_are_told(tmp_path):
    file = tmp_path / "a.mvnx"
    file.write_text(document())
    result = converted(file)
    assert any("no body to carry them" in text for text in result.remarks)
    hinge = BODY.replace('type="ball"', 'type="hinge"').replace("</body></body>", (
        '<body name="RightUpperLeg"><joint type="ball"/><geom size=".1"/></body></body></body>'
    ))  # fmt: skip
    (tmp_path / "b.xml").write_text(hinge)
    result = converted(file, body=tmp_path / "b.xml")
    assert result.recording.truth is None
    assert any("this body cannot carry them" in text for text in result.remarks)
    file.write_text(document(aligned=False))
    with pytest.raises(InputError, match="no body can be made of it"):
        converted(file, body="mvn")


def test_mvn_truth_of_a_moving_character_is_its_segments_orientations():
    from mocap_jax.conversion.mvn_body import mvn_body, truth_on
    from mocap_jax.io.convert import SegmentPoses

    n, names = 4, ("Pelvis", "L5", "RightUpperLeg")
    turns = Rotation.random(n * 3, random_state=0)
    R = turns.as_matrix().reshape(n, 3, 3, 3)
    quaternion = turns.as_quat(scalar_first=True).reshape(n, 3, 4)
    offsets = np.array([[0.0, 0, 1], [0, 0, 1.1], [0.0, -0.1, 0.9]])
    position = np.zeros((n, 3, 3))
    poses = SegmentPoses(names, np.arange(n) / 60 + 5, quaternion, position, offsets)
    body = mvn_body(poses, "x")
    truth = truth_on(body, poses, 5.0)
    assert truth is not None and truth.trajectory.time[0] == 0.0
    rotations, positions = segment_poses(body, np.asarray(truth.trajectory.q))
    np.testing.assert_allclose(rotations[:, 1:], R, atol=1e-6)
    at = np.einsum("nij,j->ni", R[:, 0], offsets[2] - offsets[0])
    np.testing.assert_allclose(positions[:, 3], at, atol=1e-6)


def test_opensense_on_the_human(shared_data):
    folder = shared_data / "opensense_walking"
    result = converted(folder / "IMUData", mapping=folder / "myIMUMappings.xml", body=mj.human())
    assert not result.findings
    validate_recording(result.recording)
    assert same_rotations(
        result.recording.inertial["torso_imu"].orientation[:1],
        converted(folder / "IMUData").recording.inertial["00B42268"].orientation[:1],
    )
