"""DIP-IMU pickles: a Y-up world, gravity removed, and nothing but arrays let through."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from known_motion import known, same_rotations

from mocap_jax.errors import InputError
from mocap_jax.io.convert import read_source, recording_of, worn_sensors
from mocap_jax.io.convert.convention import WORLD_UPS
from mocap_jax.io.convert.dip_imu import SENSORS


def write(file: Path, n: int = 60, **changes) -> list:
    motions = [known(n, 60.0, seed) for seed in range(len(SENSORS))]
    R_file_ours = WORLD_UPS["y"].T
    content = {
        "imu_ori": np.stack([R_file_ours @ m.matrices for m in motions], axis=1),
        "imu_acc": np.stack([m.free_world @ R_file_ours.T for m in motions], axis=1),
        "gt": np.zeros((n, 72)),
    }
    with open(file, "wb") as stream:
        pickle.dump(content | changes, stream, protocol=2)
    return motions


def converted(file: Path):
    source = read_source(file)
    return source, recording_of(source, worn_sensors(source, None))


def test_round_trip(tmp_path):
    motions = write(tmp_path / "01.pkl")
    source, read = converted(tmp_path / "01.pkl")
    assert list(read.inertial) == list(SENSORS.values())
    for motion, stream in zip(motions, read.inertial.values(), strict=True):
        np.testing.assert_allclose(stream.time, motion.time)
        np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-9)
        assert same_rotations(stream.orientation, motion.orientation)
        assert np.isnan(stream.gyroscope).all()
    assert read.setup.provenance["source_world_up"] == "y" and source.remarks


def test_missing_samples_stay_missing(tmp_path):
    motions = write(tmp_path / "01.pkl")
    acceleration = np.stack([m.free_world for m in motions], axis=1)
    acceleration[7, 3] = np.nan
    write(tmp_path / "01.pkl", imu_acc=acceleration)
    _, read = converted(tmp_path / "01.pkl")
    assert np.isnan(list(read.inertial.values())[3].accelerometer[7]).all()


class _Harmful:
    def __reduce__(self):
        return print, ("run by a pickle",)


def test_a_pickle_that_runs_something_is_refused_unrun(tmp_path, capsys):
    write(tmp_path / "a.pkl", imu_ori=_Harmful())
    with pytest.raises(InputError, match=r"print, which is no array"):
        converted(tmp_path / "a.pkl")
    assert "run by" not in capsys.readouterr().out


def test_wrong_files_are_refused(tmp_path):
    (tmp_path / "a.pkl").write_bytes(b"nothing")
    with pytest.raises(InputError, match="not a readable DIP-IMU pickle"):
        converted(tmp_path / "a.pkl")
    write(tmp_path / "b.pkl", imu_acc=np.zeros((60, 6, 3)))
    with pytest.raises(InputError, match=r"expected \(n, 17, 3, 3\) and \(n, 17, 3\)"):
        converted(tmp_path / "b.pkl")
    with open(tmp_path / "c.pkl", "wb") as stream:
        pickle.dump({"imu_ori": 1}, stream)
    with pytest.raises(InputError, match="lacks 'imu_acc'; it holds imu_ori"):
        converted(tmp_path / "c.pkl")
