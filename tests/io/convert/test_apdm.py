"""APDM recordings: HDF5 of the Opal v2 layout, and CSV with the same quantities."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_motion import Known, known, same_rotations

from mocap_jax.errors import InputError
from mocap_jax.io.convert import read_source, recording_of, worn_sensors

h5py = pytest.importorskip("h5py")
EPOCH_US = 1_700_000_000_000_000
RATE = 128.0


def write_h5(file: Path, sensors: dict[str, tuple[str, Known]], *, leave_out: str = "") -> None:
    with h5py.File(file, "w") as document:
        document.attrs["FileFormatVersion"] = 5
        for identity, (label, motion) in sensors.items():
            group = document.create_group(f"Sensors/{identity}")
            group["Time"] = (EPOCH_US + np.rint(motion.time * 1e6)).astype(np.uint64)
            group["Accelerometer"], group["Gyroscope"] = motion.force, motion.rate
            group["Magnetometer"] = motion.field * 1e6
            settings = group.create_group("Configuration")
            settings.attrs["Label 0"] = np.bytes_(label + "\x00\x00")
            settings.attrs["Sample Rate"] = RATE
            document[f"Processed/{identity}/Orientation"] = motion.orientation
            if leave_out:
                del group[leave_out]


def converted(path: Path, format: str | None = None):
    source = read_source(path, format)
    return recording_of(source, worn_sensors(source, None))


def test_hdf5_round_trip(tmp_path):
    sensors = {"3142": ("Lumbar", known(300, RATE, 1)), "3143": ("Right Foot", known(300, RATE, 2))}
    write_h5(tmp_path / "walk.h5", sensors)
    read = converted(tmp_path / "walk.h5")
    for name, (_, motion) in zip(("Lumbar", "Right_Foot"), sensors.values(), strict=True):
        stream = read.inertial[name]
        np.testing.assert_allclose(stream.time, motion.time, atol=1e-6)
        np.testing.assert_array_equal(stream.accelerometer, motion.force)
        np.testing.assert_array_equal(stream.gyroscope, motion.rate)
        assert same_rotations(stream.orientation, motion.orientation)
        np.testing.assert_allclose(read.magnetic[name].field, motion.field, atol=1e-12)
    facts = read.setup.provenance
    assert facts["segment/Right_Foot"] == "RightFoot" and facts["segment/Lumbar"] == "Pelvis"
    assert facts["sensor/Lumbar"] == "3142" and "north-west-up" in facts["heading"]
    assert read.start_utc_ns == EPOCH_US * 1000
    assert all(s.rate_hz == RATE for s in read.setup.sensors)


def test_missing_data_sets(tmp_path):
    write_h5(tmp_path / "a.h5", {"1": ("Head", known(50, RATE))}, leave_out="Gyroscope")
    assert np.isnan(converted(tmp_path / "a.h5").inertial["Head"].gyroscope).all()
    write_h5(tmp_path / "b.h5", {"1": ("Head", known(50, RATE))}, leave_out="Accelerometer")
    with pytest.raises(InputError, match="/Sensors/1: lacks Accelerometer; it holds"):
        converted(tmp_path / "b.h5")


def test_wrong_files_are_refused(tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as document:
        document["Data"] = np.zeros(3)
    with pytest.raises(InputError, match="no group /Sensors.*it holds Data"):
        converted(tmp_path / "other.h5")
    write_h5(tmp_path / "a.h5", {"1": ("Head", known(500, RATE))})
    whole = (tmp_path / "a.h5").read_bytes()
    (tmp_path / "a.h5").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="not a readable HDF5 file"):
        converted(tmp_path / "a.h5")


def test_csv_round_trip(tmp_path):
    motion = known(200, RATE)
    names = ["Time"] + [f"{w} {a} (unit)" for w in ("Accelerometer", "Gyroscope", "Magnetometer")
                        for a in "XYZ"] + [f"Orientation {a}" for a in "SXYZ"]  # fmt: skip
    time = EPOCH_US + np.rint(motion.time * 1e6)
    rows = np.hstack([motion.force, motion.rate, motion.field * 1e6, motion.orientation])
    lines = [f"{t:.0f}," + ",".join(f"{x:.9f}" for x in row)
             for t, row in zip(time, rows, strict=True)]  # fmt: skip
    (tmp_path / "walk_Lumbar.csv").write_text("\n".join([",".join(names), *lines]))
    read = converted(tmp_path, "apdm-csv")
    stream = read.inertial["Lumbar"]
    np.testing.assert_allclose(stream.time, motion.time, atol=1e-6)
    np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-8)
    np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-8)
    assert same_rotations(stream.orientation, motion.orientation)
    assert abs(read.start_utc_ns - EPOCH_US * 1000) < 1000


def test_csv_without_accelerometer_is_refused(tmp_path):
    (tmp_path / "a.csv").write_text("Time,Foo\n0,1\n1,2\n")
    with pytest.raises(InputError, match="no columns 'Accelerometer X'.*columns: Time, Foo"):
        converted(tmp_path, "apdm-csv")
