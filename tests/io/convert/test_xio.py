"""x-io device folders: x-IMU3 and NGIMU, each kind of message at its own rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_motion import GRAVITY, Known, known, same_rotations

from mocap_jax.errors import InputError
from mocap_jax.io.convert import ReadOptions, read_source, recording_of, worn_sensors
from mocap_jax.io.convert.xio import interpolated


def table(file: Path, header: str, rows: np.ndarray) -> None:
    lines = [",".join(f"{x:.9f}" for x in row) for row in rows]
    file.write_text("\n".join([header, *lines]) + "\n")


def axes(what: str, unit: str) -> str:
    return ",".join(f"{what} {a} ({unit})" for a in "XYZ")


def x_imu3(folder: Path, motion: Known, start: float = 3.0, *, unit: str = "us") -> None:
    folder.mkdir()
    name, scale = ("Timestamp (us)", 1e6) if unit == "us" else ("Time (s)", 1.0)
    t = (motion.time + start)[:, None] * scale
    inertial = np.hstack([t, np.rad2deg(motion.rate), motion.force / GRAVITY])
    names = f"{name},{axes('Gyroscope', 'deg/s')},{axes('Accelerometer', 'g')}"
    table(folder / "Inertial.csv", names, inertial)
    table(folder / "Quaternion.csv", f"{name},W,X,Y,Z",
          np.hstack([t, motion.orientation])[::2])  # fmt: skip
    table(folder / "Magnetometer.csv", f"{name},{axes('Magnetometer', 'a.u.')}",
          np.hstack([t, motion.field / 5e-5])[::5])  # fmt: skip


def ngimu(folder: Path, motion: Known) -> None:
    folder.mkdir()
    t = motion.time[:, None]
    header = ",".join(["Time (s)", axes("Gyroscope", "deg/s"), axes("Accelerometer", "g"),
                       axes("Magnetometer", "uT"), "Barometer (hPa)"])  # fmt: skip
    rows = [t, np.rad2deg(motion.rate), motion.force / GRAVITY, motion.field * 1e6, 0 * t]
    table(folder / "sensors.csv", header, np.hstack(rows))
    table(folder / "quaternion.csv", "Time (s),W,X,Y,Z", np.hstack([t, motion.orientation]))


def recording(path, **options):
    source = read_source(path, options=ReadOptions(**options))
    assert source.format == "x-io"
    return recording_of(source, worn_sensors(source, None))


@pytest.mark.parametrize("unit", ["us", "s"])
def test_x_imu3_round_trip(tmp_path, unit):
    a, b = known(300, 200.0, 1), known(300, 200.0, 2)
    x_imu3(tmp_path / "chest", a, unit=unit)
    x_imu3(tmp_path / "left_thigh", b, 3.25, unit=unit)
    read = recording(tmp_path)
    for name, motion, shift in (("chest", a, 0.0), ("left_thigh", b, 0.25)):
        stream = read.inertial[name]
        np.testing.assert_allclose(stream.time, motion.time + shift, atol=1e-7)
        np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)
        np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-7)
        known_at = np.isfinite(stream.orientation).all(axis=1)
        assert known_at.sum() == 299, "the last sample is beyond the last quaternion"
        assert same_rotations(stream.orientation[:-1], motion.orientation[:-1], 1e-4)
        field = read.magnetic[name]
        np.testing.assert_allclose(field.time, motion.time[::5] + shift, atol=1e-7)
        np.testing.assert_allclose(field.field, motion.field[::5], atol=1e-12)
    assert [s.rate_hz for s in read.setup.sensors] == [pytest.approx(200.0)] * 2
    assert read.setup.provenance["segment/left_thigh"] == "LeftUpperLeg"


def test_ngimu_round_trip(tmp_path):
    motion = known(200)
    ngimu(tmp_path / "device", motion)
    read = recording(tmp_path / "device")
    stream = read.inertial["device"]
    np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)
    np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-7)
    assert same_rotations(stream.orientation, motion.orientation)
    np.testing.assert_allclose(read.magnetic["device"].field, motion.field, atol=1e-11)


def test_devices_of_different_units_are_refused(tmp_path):
    x_imu3(tmp_path / "a", known(50))
    ngimu(tmp_path / "b", known(50))
    with pytest.raises(InputError, match=r"b: magnetometer unit is uT, of the devices before.*a.u"):
        recording(tmp_path)


def test_orientations_are_not_interpolated_over_gaps():
    motion = known(100)
    kept = np.r_[0:40, 60:100]
    out = interpolated(motion.time[kept], motion.orientation[kept], motion.time)
    assert np.isnan(out[41:59]).all() and np.isfinite(out[kept]).all()


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "the file is empty"),
        ("Time (s),Gyroscope X (deg/s)\n0,1\n", "no columns 'Accelerometer X' to"),
        ("Clock,Gyroscope X (deg/s)\n0,1\n", r"no column 'Time \(s\)' or 'Timestamp \(us\)'"),
        (f"Time (s),{axes('Accelerometer', 'g')},{axes('Gyroscope', 'deg/s')}\n"
         "1,0,0,1,0,0,0\n0.5,0,0,1,0,0,0\n", "line 3: time runs backwards"),
        (f"Time (s),{axes('Accelerometer', 'g')}\n", "no rows of data"),
    ],
)  # fmt: skip
def test_wrong_files_are_refused(tmp_path, text, words):
    (tmp_path / "device").mkdir()
    (tmp_path / "device" / "Inertial.csv").write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        recording(tmp_path)
    assert "Inertial.csv" in str(caught.value)
