"""Xsens MT exports: real ones of OpenSense, and files of the same layout with known content."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_motion import Known, known, same_rotations
from scipy.spatial.transform import Rotation
from xsens_files import write

from mocap_jax.errors import InputError
from mocap_jax.io.convert import (
    ReadOptions,
    read_mapping,
    read_source,
    recording_of,
    worn_sensors,
)


def recording(path: Path, **options):
    source = read_source(path, options=ReadOptions(**options))
    return recording_of(source, worn_sensors(source, None))


@pytest.mark.parametrize("kind", ["Quat", "Mat"])
def test_round_trip(tmp_path, kind):
    motion = known(200)
    write(tmp_path, motion, columns=("Acc", "Gyr", "Mag", kind))
    read = recording(tmp_path)
    stream = read.inertial["00B4AAAA"]
    np.testing.assert_allclose(stream.time, motion.time, atol=1e-9)
    np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-8)
    np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-8)
    assert same_rotations(stream.orientation, motion.orientation)
    np.testing.assert_allclose(read.magnetic["00B4AAAA"].field, motion.field, atol=1e-12)
    assert read.setup.provenance["sampling_rate_hz"] == 100.0
    assert read.setup.sensors[0].rate_hz == 100.0 and not read.salvage


def test_absent_kinds_are_nan(tmp_path):
    write(tmp_path, known(50), columns=("Acc",))
    stream = recording(tmp_path).inertial["00B4AAAA"]
    assert np.isfinite(stream.accelerometer).all()
    assert np.isnan(stream.gyroscope).all() and np.isnan(stream.orientation).all()


def test_counter_wraps_around_and_sensors_start_on_both_sides(tmp_path):
    a, b = known(60, seed=1), known(60, seed=2)
    write(tmp_path, a, "00B4AAAA", counters=np.arange(65526, 65586) % 65536)
    write(tmp_path, b, "00B4BBBB", counters=np.arange(65531, 65591) % 65536)
    read = recording(tmp_path)
    first, second = read.inertial["00B4AAAA"], read.inertial["00B4BBBB"]
    np.testing.assert_allclose(first.time, a.time, atol=1e-9)
    np.testing.assert_allclose(second.time, b.time + 0.05, atol=1e-9)
    write(tmp_path, b, "00B4BBBB", counters=np.arange(4, 64))
    second = recording(tmp_path).inertial["00B4BBBB"]
    np.testing.assert_allclose(second.time, b.time + 0.14, atol=1e-9)


def test_missing_packets_become_gaps(tmp_path):
    motion = known(60)
    kept = np.delete(np.arange(60), [20, 21, 40])
    thinned = Known(*(getattr(motion, f)[kept] for f in motion.__dataclass_fields__))
    write(tmp_path, thinned, counters=kept + 7)
    read = recording(tmp_path)
    stream = read.inertial["00B4AAAA"]
    np.testing.assert_allclose(stream.time, motion.time, atol=1e-9)
    assert np.isnan(stream.accelerometer[[20, 21, 40]]).all()
    np.testing.assert_allclose(stream.accelerometer[kept], thinned.force, atol=1e-8)
    assert len(read.salvage) == 1 and "3 packets are missing" in read.salvage[0]


def test_a_counter_with_a_damaged_digit_is_refused(tmp_path):
    counters = np.arange(70_000, 70_060)
    counters[40:] += 9_000_000
    write(tmp_path, known(60), counters=counters)
    with pytest.raises(InputError, match=r"holds 60 \(jumps from 70039 to 9070040"):
        recording(tmp_path)


def test_truncated_last_row_is_salvaged(tmp_path):
    file = write(tmp_path, known(30))
    text = file.read_text().rstrip("\n")
    file.write_text(text[:-40].rsplit("\t", 1)[0])
    read = recording(tmp_path)
    assert len(read.inertial["00B4AAAA"].time) == 29
    assert "truncated" in read.salvage[0] and file.name in read.salvage[0]


def test_rate_given_replaces_that_of_the_files(tmp_path):
    write(tmp_path, known(30), rate=None)
    with pytest.raises(InputError, match=r"Update Rate.*--rate"):
        recording(tmp_path)
    assert recording(tmp_path, rate_hz=50.0).inertial["00B4AAAA"].time[1] == pytest.approx(0.02)


def test_several_trials_have_to_be_told_apart(tmp_path):
    write(tmp_path, known(30), trial="MT_01-000")
    write(tmp_path, known(40), trial="MT_01-001")
    with pytest.raises(InputError, match=r"2 trials \(MT_01-000, MT_01-001\)"):
        recording(tmp_path)
    assert len(recording(tmp_path, trial="MT_01-001").inertial["00B4AAAA"].time) == 40
    with pytest.raises(InputError, match="unknown trial 'MT_02'; valid: MT_01-000, MT_01-001"):
        recording(tmp_path, trial="MT_02")


def replaced(file: Path, line: int, text: str) -> None:
    lines = file.read_text().splitlines()
    lines[line - 1] = text
    file.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    "line, text, words",
    [
        (10, "00480\t\t1.0", r"line 10 has 3 cells, the header names 15"),
        (10, "00300" + "\t1" * 14, r"line 10: the packet counter runs backwards"),
        (10, "00477" + "\t1" * 14, r"line 10: the packet counter repeats"),
        (10, "\t" * 13 + "\t1", r"line 10: no PacketCounter"),
        (9, "00477\t\tfoo" + "\t0" * 12, r"line 9, column 'Acc_X': 'foo' is not a number"),
        (3, "PacketCounter\t" + "\t".join("abcdefghijklmn"), r"none of the columns Acc_X"),
    ],
)
def test_wrong_files_are_refused_by_line(tmp_path, line, text, words):
    file = write(tmp_path, known(30))
    replaced(file, line, text)
    with pytest.raises(InputError, match=words) as caught:
        recording(tmp_path)
    assert file.name in str(caught.value) and "\n" not in str(caught.value)


def test_empty_and_foreign_folders_are_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("nothing")
    with pytest.raises(InputError, match="no Xsens MT exports"):
        read_source(tmp_path, "xsens-mt")
    with pytest.raises(InputError, match="no such file or folder"):
        read_source(tmp_path / "elsewhere")


@pytest.mark.parametrize("content", ["", "// Update Rate: 100.0Hz\n", "\x00\xff" * 50])
def test_a_damaged_file_among_sound_ones_is_not_passed_over(tmp_path, content):
    write(tmp_path, known(30), "00B4AAAA")
    file = write(tmp_path, known(30), "00B4BBBB")
    file.write_text(content)
    with pytest.raises(InputError, match=file.name):
        recording(tmp_path)


@pytest.fixture
def opensense(shared_data) -> Path:
    return shared_data / "opensense_walking"


def test_opensense_walking(opensense):
    mapping = read_mapping(opensense / "myIMUMappings.xml")
    source = read_source(opensense / "IMUData", options=ReadOptions(trial=mapping.trial))
    read = recording_of(source, worn_sensors(source, mapping))
    assert set(read.inertial) == {
        f"{s}_imu" for s in ("torso", "pelvis", "tibia_r", "femur_r", "calcn_r", "tibia_l",
                             "femur_l", "calcn_l")
    }  # fmt: skip
    assert read.setup.provenance["segment/calcn_r_imu"] == "RightFoot"
    counts = {n: len(s.time) for n, s in read.inertial.items()}
    assert counts["calcn_l_imu"] == 2432 and counts["tibia_r_imu"] == 2505
    for stream in read.inertial.values():
        assert stream.time[0] == 0.0 and np.allclose(np.diff(stream.time), 0.01)
        turn = Rotation.from_quat(stream.orientation, scalar_first=True)
        up = turn.apply(stream.accelerometer).mean(axis=0)
        np.testing.assert_allclose(up, [0, 0, 9.81], atol=0.12)
        assert np.isnan(stream.gyroscope).all()
