"""Plain CSV files with a mapping of their columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_motion import GRAVITY, known, same_rotations

from mocap_jax.errors import InputError
from mocap_jax.io.convert import ReadOptions, read_column_mapping, read_source, recording_of
from mocap_jax.io.convert import worn_sensors as worn

MAPPING = """
format = "csv"
time = "t"
time_unit = "ms"
accelerometer_unit = "g"
gyroscope_unit = "deg/s"
magnetometer_unit = "mG"
quaternion_order = "xyzw"
quaternion_direction = "world-to-sensor"
[[sensors]]
segment = "T8"
name = "chest"
accelerometer = ["ax", "ay", "az"]
gyroscope = ["gx", "gy", "gz"]
magnetometer = ["mx", "my", "mz"]
orientation = ["qx", "qy", "qz", "qw"]
mount_orientation = [1, 0, 0, 0]
"""
HEADER = "t;ax;ay;az;gx;gy;gz;mx;my;mz;qx;qy;qz;qw"


def write(folder: Path, mapping: str = MAPPING, name: str = "a.csv") -> Path:
    motion = known(100)
    inverse = motion.orientation * [1, -1, -1, -1]
    rows = np.hstack([
        motion.time[:, None] * 1e3 + 5000, motion.force / GRAVITY, np.rad2deg(motion.rate),
        motion.field * 1e7, np.roll(inverse, -1, axis=1),
    ])  # fmt: skip
    lines = [";".join(f"{x:.9f}" for x in row) for row in rows]
    (folder / name).write_text("\n".join(["# a comment", HEADER, *lines]) + "\n")
    (folder / "map.toml").write_text(mapping)
    return folder / name


def converted(file: Path, **options):
    mapping = str(file.parent / "map.toml")
    source = read_source(file, options=ReadOptions(mapping=mapping, **options))
    names = read_column_mapping(mapping, "csv", "x").mapping
    return recording_of(source, worn(source, names))


def test_round_trip(tmp_path):
    motion, read = known(100), converted(write(tmp_path))
    stream = read.inertial["chest"]
    np.testing.assert_allclose(stream.time, motion.time, atol=1e-9)
    np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)
    np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-7)
    assert same_rotations(stream.orientation, motion.orientation)
    np.testing.assert_allclose(read.magnetic["chest"].field, motion.field, atol=1e-12)
    facts = read.setup.provenance
    assert facts["sampling_rate_hz"] == pytest.approx(100.0) and facts["clock"] == "column t"
    assert facts["source_quaternion_order"] == "xyzw" and facts["segment/chest"] == "T8"


def test_rate_instead_of_time(tmp_path):
    text = MAPPING.replace('time = "t"', "rate_hz = 50")
    stream = converted(write(tmp_path, text)).inertial["chest"]
    np.testing.assert_allclose(np.diff(stream.time), 0.02)
    text = MAPPING.replace('time = "t"', "")
    with pytest.raises(InputError, match="says neither the time column"):
        converted(write(tmp_path, text))
    assert converted(tmp_path / "a.csv", rate_hz=10.0).inertial["chest"].time[1] == 0.1


def test_a_file_a_sensor(tmp_path):
    write(tmp_path, name="b.csv")
    second = MAPPING[MAPPING.index("[[") :].replace("chest", "back").replace("T8", "L3")
    text = MAPPING + 'file = "a.csv"\n' + second + 'file = "b.csv"\n'
    write(tmp_path, text)
    source = read_source(tmp_path, "csv", ReadOptions(mapping=str(tmp_path / "map.toml")))
    assert [s.identity for s in source.sensors] == ["a.csv", "b.csv"]


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('"ax", "ay"', '"ax", "ayy"', "unknown column 'ayy'; valid: ay"),
        ('"ax", "ay", "az"', '"ax", "ay"', "accelerometer has 2 columns, expected 3"),
        ('gyroscope_unit = "deg/s"', 'gyroscope_unit = "dps"', "unknown gyroscope unit 'dps'"),
        ('time_unit = "ms"', 'time_unit = "min"', "unknown time unit 'min'; valid: s, ms"),
        ("accelerometer =", "acelerometer =", "unknown key 'acelerometer'; valid: accelerometer"),
        ('format = "csv"', 'format = "xls"', "unknown format 'xls'; valid: csv, mat"),
        ('format = "csv"', 'format = "mat"', "is a mapping of mat files"),
        ('[[sensors]]', '[sensors]', "must be written as"),
        ("[1, 0, 0, 0]", "[1, 1, 0, 0]", "expected a unit quaternion"),
        ('name = "chest"', 'file = "c.csv"', "unknown file 'c.csv'; valid: a.csv"),
    ],
)  # fmt: skip
def test_wrong_mappings_are_refused(tmp_path, old, new, words):
    assert old in MAPPING
    with pytest.raises(InputError, match=words) as caught:
        converted(write(tmp_path, MAPPING.replace(old, new)))
    assert "map.toml" in str(caught.value) or "a.csv" in str(caught.value)


def test_without_a_mapping_it_is_said_what_to_write(tmp_path):
    with pytest.raises(InputError, match=r"needs a mapping.*--mapping FILE.toml.*qmt_full_body"):
        read_source(write(tmp_path))


def test_binary_and_ragged_files_are_refused(tmp_path):
    file = write(tmp_path)
    text = file.read_text()
    file.write_text(text.replace("\n5010", "\n5010;7;8", 1))
    with pytest.raises(InputError, match=r"a.csv: line 4 has 16 cells, the header names 14"):
        converted(file)
    file.write_bytes(b"\x00\xff" * 100)
    with pytest.raises(InputError, match="a.csv: not a text file"):
        converted(file)


NUMBERED = """
format = "csv"
header = false
time = 1
time_unit = "ms"
accelerometer_unit = "g"
gyroscope_unit = "deg/s"
quaternion_order = "xyzw"
quaternion_direction = "world-to-sensor"
[[sensors]]
segment = "T8"
name = "chest"
accelerometer = [2, 3, 4]
gyroscope = [5, 6, 7]
orientation = [11, 12, 13, 14]
"""


def bare(folder: Path, mapping: str) -> Path:
    """The table in blanks, without its header."""
    named = write(folder, mapping)
    text = named.read_text().replace(HEADER + "\n", "").replace(";", "  ")
    (folder / "bare.txt").write_text(text)
    named.unlink()
    return folder / "bare.txt"


def test_a_table_without_header_has_numbered_columns(tmp_path):
    motion, read = known(100), converted(bare(tmp_path, NUMBERED))
    stream = read.inertial["chest"]
    assert len(stream.time) == 100  # the first row is one
    np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)
    np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-7)
    assert same_rotations(stream.orientation, motion.orientation)


def test_a_table_without_header_is_told_from_one_with(tmp_path):
    file = bare(tmp_path, MAPPING)
    for text in (file.read_text(), "1.0 2.0 3.0\n4.0 5.0 6.0\n"):
        file.write_text(text)
        with pytest.raises(InputError, match="bare.txt: the first line .* header = false in"):
            converted(file)


def test_headers_may_be_numbers(tmp_path):
    file = write(tmp_path, NUMBERED.replace("header = false", ""))
    lines = file.read_text().splitlines()
    lines[1] = ";".join(str(i + 1) for i in range(14))
    file.write_text("\n".join(lines))
    np.testing.assert_allclose(
        converted(file).inertial["chest"].accelerometer, known(100).force, atol=1e-7
    )


def test_a_header_is_there_or_not(tmp_path):
    with pytest.raises(InputError, match="header must be true or false"):
        converted(bare(tmp_path, NUMBERED.replace("header = false", 'header = "no"')))


def test_a_first_row_without_header_may_end_in_empty_cells(tmp_path):
    """Orientations and magnetometers start later than the rest, as in many logs."""
    file = bare(tmp_path, NUMBERED)
    lines = [",".join(line.split()) for line in file.read_text().splitlines()]
    lines[0] = ",".join(lines[0].split(",")[:7]) + 7 * ","
    file.write_text("\n".join(lines))
    motion, stream = known(100), converted(file).inertial["chest"]
    np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)
    assert same_rotations(stream.orientation[1:], motion.orientation[1:])


def test_ragged_rows_without_header_name_no_header(tmp_path):
    file = bare(tmp_path, NUMBERED)
    lines = file.read_text().splitlines()
    lines[4] += "  7  8"
    file.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"bare.txt: line 2 has 14 cells, line 5 has 16$"):
        converted(file)
