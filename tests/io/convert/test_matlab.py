"""MATLAB files: presets on real data, both versions of the format, missing variables."""

from __future__ import annotations

import numpy as np
import pytest
from known_motion import known, same_rotations
from scipy.io import savemat

from mocap_jax.errors import InputError
from mocap_jax.io.convert import ReadOptions, presets, read_source, recording_of, worn_sensors
from mocap_jax.io.convert import read_column_mapping as read_columns

MAPPING = """
format = "mat"
rate_hz = "info.rate"
[[sensors]]
segment = "Pelvis"
accelerometer = "hip.data[0:3]"
gyroscope = "hip.data[3:6]"
orientation = "hip.R"
"""


def contents():
    motion = known(80, 50.0)
    both = np.hstack([motion.force, motion.rate])
    return motion, {"info": {"rate": 50.0}, "hip": {"data": both, "R": motion.matrices}}


def converted(path, mapping):
    (path.parent / "map.toml").write_text(mapping)
    name = str(path.parent / "map.toml")
    source = read_source(path, options=ReadOptions(mapping=name))
    return recording_of(source, worn_sensors(source, read_columns(name, "mat", "x").mapping))


def check(read, motion):
    stream = read.inertial["Pelvis"]
    np.testing.assert_allclose(stream.time, motion.time, atol=1e-12)
    np.testing.assert_allclose(stream.accelerometer, motion.force)
    np.testing.assert_allclose(stream.gyroscope, motion.rate)
    assert same_rotations(stream.orientation, motion.orientation)
    assert read.setup.provenance["sampling_rate_hz"] == 50.0


def test_version_5(tmp_path):
    motion, variables = contents()
    savemat(tmp_path / "a.mat", variables)
    check(converted(tmp_path / "a.mat", MAPPING), motion)


def test_version_7_3(tmp_path):
    h5py = pytest.importorskip("h5py")
    motion, variables = contents()
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as document:
        document["info/rate"] = [[50.0]]
        document["hip/data"] = variables["hip"]["data"].T  # MATLAB stores columns first
        document["hip/R"] = np.transpose(variables["hip"]["R"], (2, 1, 0))
    with open(tmp_path / "a.mat", "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(128))
    check(converted(tmp_path / "a.mat", MAPPING), motion)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("hip.R", "hip.Q", "unknown variable in 'hip' 'Q'; valid: "),
        ("hip.R", "hop.R", "unknown variable 'hop'; valid: hip, info"),
        ("[3:6]", "[3:5]", r"has shape \(80, 2\), expected \(n, 3\) for gyroscope"),
        ('rate_hz = "info.rate"\n', "", "says neither time nor rate_hz"),
        ('"mat"\n', '"mat"\nheader = false\n', "map.toml: 'header' is for csv files; mat files"),
    ],
)
def test_wrong_mappings_are_refused(tmp_path, old, new, words):
    savemat(tmp_path / "a.mat", contents()[1])
    with pytest.raises(InputError, match=words):
        converted(tmp_path / "a.mat", MAPPING.replace(old, new))


def test_wrong_files_are_refused(tmp_path):
    (tmp_path / "a.mat").write_bytes(b"no MATLAB file" * 20)
    with pytest.raises(InputError, match="not a readable MATLAB file"):
        read_source(tmp_path / "a.mat")
    savemat(tmp_path / "b.mat", {"x": np.zeros(3)})
    with pytest.raises(InputError, match="needs a mapping"):
        read_source(tmp_path / "b.mat")


@pytest.mark.parametrize("name", presets())
def test_presets_are_sound(name):
    assert read_columns(name, "mat", "x").sensors


def test_unknown_preset_names_the_valid_ones():
    with pytest.raises(InputError, match="unknown preset 'qmt'; valid: .*qmt_full_body"):
        read_columns("qmt", "mat", "x")


def test_qmt_full_body(shared_data):
    source = read_source(shared_data / "qmt_full_body_16imu")
    assert source.format == "mat" and source.facts["mapping"] == "qmt_full_body.toml"
    assert [s.identity for s in source.sensors][:3] == ["hip", "lower_back", "upper_back"]
    mapping = read_columns("qmt_full_body", "mat", "x").mapping
    read = recording_of(source, worn_sensors(source, mapping))
    assert len(read.inertial) == 16 and read.inertial["LeftFoot"].time[-1] == pytest.approx(99.99)
    for stream in read.inertial.values():
        start = np.linalg.norm(stream.accelerometer[:50].mean(axis=0))
        assert start == pytest.approx(9.81, rel=0.05)
        assert np.isnan(stream.orientation).all(), "the file's quaternions fit nothing"
    assert any("quaternions are left out" in r for r in source.remarks)


def test_broad(shared_data):
    source = read_source(shared_data / "broad" / "02_undisturbed_slow_rotation_B.mat")
    read = recording_of(source, worn_sensors(source, None))
    assert read.setup.sensors[0].rate_hz == pytest.approx(2000 / 7)
    field = np.linalg.norm(read.magnetic["imu"].field, axis=1)
    assert 2e-5 < np.median(field) < 7e-5
    assert read.root is None, "a reference is no measurement"
    assert read.truth is not None and np.isfinite(read.truth.trajectory.q).all()
    assert read.truth.trajectory.q.shape[1] == 7
    assert len(read.truth.trajectory.time) < len(read.inertial["imu"].time), "gaps"
