"""Which sensor is worn where: three kinds of mapping files, and names of segments."""

from __future__ import annotations

import pytest

from mocap_jax.errors import InputError
from mocap_jax.io.convert import read_mapping
from mocap_jax.io.convert.segments import segment_of

XML = """<?xml version="1.0"?><OpenSimDocument><XsensDataReaderSettings>
<trial_prefix>MT_01</trial_prefix><ExperimentalSensors>
<ExperimentalSensor name="_00B4AAAA"><name_in_model>torso_imu</name_in_model></ExperimentalSensor>
<ExperimentalSensor name="_00B4BBBB"><name_in_model>femur_r_imu</name_in_model></ExperimentalSensor>
</ExperimentalSensors></XsensDataReaderSettings></OpenSimDocument>"""
TOML = """
[[sensors]]
id = "00B4AAAA"
segment = "T8"
name = "chest"
position = [0.1, 0, 0.2]
orientation = [0.0, 0.0, 2.0, 0.0]
[[sensors]]
id = "00B4BBBB"
segment = "femur_r"
"""


def mapped(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    return read_mapping(tmp_path / name)


def test_opensense_xml(tmp_path):
    mapping = mapped(tmp_path, "m.xml", XML)
    assert mapping.trial == "MT_01"
    assert [(w.identity, w.segment, w.name) for w in mapping.worn] == [
        ("00B4AAAA", "T8", "torso_imu"), ("00B4BBBB", "RightUpperLeg", "femur_r_imu"),
    ]  # fmt: skip


def test_csv(tmp_path):
    mapping = mapped(tmp_path, "m.csv", "id,segment,name\n00B4AAAA,T8,\n00B4BBBB,femur_r,thigh\n")
    assert [(w.segment, w.name) for w in mapping.worn] == [
        ("T8", "T8"), ("RightUpperLeg", "thigh"),
    ]  # fmt: skip


def test_toml_with_mounting(tmp_path):
    text = TOML.replace("2.0", "1.0")
    first, second = mapped(tmp_path, "m.toml", text).worn
    assert first.position == (0.1, 0.0, 0.2) and first.orientation == (0.0, 0.0, 1.0, 0.0)
    assert second.name == second.segment == "RightUpperLeg" and second.position is None


@pytest.mark.parametrize(
    "name, text, words",
    [
        ("m.toml", TOML, "orientation has length 2, expected a unit quaternion"),
        ("m.toml", "[[sensors]]\nid='a'\nsegmnt='T8'", "unknown key 'segmnt'; valid: segment"),
        ("m.toml", "[[sensors]]\nid='a'", "'segment' is missing"),
        ("m.toml", "sensors = [", "not valid TOML"),
        ("m.toml", "", "names no sensors"),
        ("m.xml", XML[:200], "not valid XML"),
        ("m.xml", "<a/>", "no <ExperimentalSensor> entries"),
        ("m.csv", "id,where\na,T8\n", "no column 'segment'"),
        ("m.csv", "id,segment\na,T8\na,L5\n", "sensor 'a' is there twice"),
        ("m.csv", "id,segment\na,T8\nb,T8\n", "name 'T8' is there twice"),
        ("m.txt", "x", "unknown kind of mapping '.txt'; valid: .xml, .toml, .csv"),
    ],
)
def test_wrong_mappings_are_refused(tmp_path, name, text, words):
    with pytest.raises(InputError, match=words):
        mapped(tmp_path, name, text)


def test_a_sensor_that_the_recording_lacks_is_named_with_the_valid_ones(tmp_path):
    mapping = mapped(tmp_path, "m.xml", XML)
    with pytest.raises(InputError, match="unknown sensor '00B4BBBB'; valid: 00B4AAAA, 00B4CCCC"):
        mapping.of(["00B4AAAA", "00B4CCCC"], "folder")


def test_serial_numbers_match_after_a_model_name_and_in_any_case(tmp_path):
    mapping = mapped(tmp_path, "m.csv", "id,segment\n01a2b3c4,T8\n")
    assert list(mapping.of(["x-IMU3 01A2B3C4", "other"], "folder")) == ["x-IMU3 01A2B3C4"]


@pytest.mark.parametrize(
    "label, segment",
    [
        ("torso_imu", "T8"), ("calcn_r_imu", "RightFoot"), ("tibia_l", "LeftLowerLeg"),
        ("upper_arm_left", "LeftUpperArm"), ("L_LowArm", "LeftForeArm"), ("Sternum", "T8"),
        ("R_UpLeg", "RightUpperLeg"), ("Right Foot", "RightFoot"), ("Lumbar", "Pelvis"),
        ("LeftUpperLeg", "LeftUpperLeg"), ("lhumerus", "LeftUpperArm"), ("00B4AAAA", "00B4AAAA"),
        ("hand_r", "RightHand"), ("Left Wrist", "LeftForeArm"), ("T8", "T8"), ("T12", "T12"),
    ],
)  # fmt: skip
def test_names_of_segments(label, segment):
    assert segment_of(label) == segment
