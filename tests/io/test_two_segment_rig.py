"""The reader of the public two-segment rig: layout, clocks, lever arms, lost reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from mocap_jax import so3
from mocap_jax.errors import InputError
from mocap_jax.io.two_segment_rig import SENSORS, read_two_segment_rig

RATE = 50.0
ARMS = {"r_12": [0.1, 0.0, -0.02], "r_21": [-0.15, 0.01, 0.0]}


def write_trial(path: Path, *, jump: int | None = None, **changes: object) -> np.ndarray:
    """A trial whose second segment turns about z at 1 rad/s; returns its ref array."""
    samples = np.zeros((100, 12))
    samples[:, [2, 8]] = 9.81
    samples[:, 11] = 1.0
    angle = np.arange(100) / RATE
    ref = np.zeros((100, 17))
    ref[:, 0] = 1.0
    ref[:, 4], ref[:, 7] = np.cos(angle / 2), np.sin(angle / 2)
    if jump is not None:
        ref[jump, :4] = [0.0, 1.0, 0.0, 0.0]
    data = {"rate": RATE, "sensorData": samples, "ref": ref, **ARMS, **changes}
    savemat(path, {"data": data})
    return ref


def test_streams_sites_and_start_pose(tmp_path: Path) -> None:
    ref = write_trial(tmp_path / "trial.mat")
    trial = read_two_segment_rig(tmp_path / "trial.mat")
    assert tuple(trial.recording.inertial) == SENSORS == trial.body.topology.site_names
    np.testing.assert_allclose(trial.body.site_pos, [[-0.1, 0, 0.02], [0.15, -0.01, 0]])
    second = trial.recording.inertial["second"]
    np.testing.assert_allclose(np.diff(second.time), 1 / RATE)
    assert np.all(np.asarray(second.gyroscope)[:, 2] == 1.0)
    assert np.isnan(second.orientation).all()
    # The inertial clock is one sample late.
    assert not trial.known[0] and trial.known[1:].all()
    np.testing.assert_allclose(trial.reference[1:, 1], ref[:-1, 4:8])
    pose = trial.recording.setup.rest.pose
    np.testing.assert_allclose(pose["root"], [0, 0, 0, 1, 0, 0, 0])
    np.testing.assert_allclose(pose["joint"], ref[0, 4:8])


def test_lost_reference_is_marked(tmp_path: Path) -> None:
    write_trial(tmp_path / "trial.mat", jump=40)
    unknown = np.flatnonzero(~read_two_segment_rig(tmp_path / "trial.mat").known)
    assert unknown[0] == 0 and 41 in unknown
    assert unknown[1] >= 38 and unknown[-1] <= 44


def test_only_the_start(tmp_path: Path) -> None:
    write_trial(tmp_path / "trial.mat")
    trial = read_two_segment_rig(tmp_path / "trial.mat", seconds=1.0)
    assert len(trial.known) == len(trial.reference) == 50


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"r_12": None}, "r_12"), ({"sensorData": np.zeros((100, 6))}, "sensorData"),],
)  # fmt: skip
def test_other_files_are_refused(tmp_path: Path, changes: dict, message: str) -> None:
    path = tmp_path / "trial.mat"
    if changes.get("r_12", 0) is None:
        savemat(path, {"data": {"rate": RATE}})
    else:
        write_trial(path, **changes)
    with pytest.raises(InputError, match=message):
        read_two_segment_rig(path)


def test_missing_and_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_two_segment_rig(tmp_path / "absent.mat")
    (tmp_path / "text.mat").write_text("not MATLAB")
    with pytest.raises(InputError, match="MATLAB"):
        read_two_segment_rig(tmp_path / "text.mat")


def test_lever_arms_make_both_sensors_agree_in_the_joint(shared_data: Path) -> None:
    """Accelerations carried to the joint and turned to the world by the reference coincide."""
    file = shared_data / "two_segment_rig" / "data_2D_01.mat"
    if not file.is_file():
        pytest.skip(f"{file} is absent")
    trial = read_two_segment_rig(file)
    at_joint = []
    for i, name in enumerate(SENSORS):
        stream = trial.recording.inertial[name]
        rate, arm = np.asarray(stream.gyroscope), np.asarray(trial.body.site_pos)[i]
        turn = np.gradient(rate, 1 / RATE, axis=0)
        lever = np.cross(turn, arm) + np.cross(rate, np.cross(rate, arm))
        force = np.asarray(stream.accelerometer) - lever
        known = trial.known
        R = np.asarray(so3.quat_to_matrix(trial.reference[known, i]))
        at_joint.append(np.einsum("tij,tj->ti", R, force[known]))
    distance = np.median(np.linalg.norm(at_joint[0] - at_joint[1], axis=1))
    assert distance < 0.4  # the other sign of the lever arms makes 1.8
