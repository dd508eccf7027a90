"""The reader of BROAD: stamps, gaps of the reference, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from mocap_jax.errors import InputError
from mocap_jax.io.broad import read_broad

RATE = 200.0


def write_trial(path: Path, **changes: object) -> None:
    """A still trial of 100 samples; a change to None leaves the field out."""
    quaternion = np.tile([1.0, 0, 0, 0], (100, 1))
    quaternion[40:45] = np.nan
    fields = {
        "imu_gyr": np.zeros((100, 3)), "imu_acc": np.tile([0, 0, 9.81], (100, 1)),
        "opt_quat": quaternion, "movement": np.arange(100) >= 30, "sampling_rate": RATE, **changes,
    }  # fmt: skip
    savemat(path, {k: v for k, v in fields.items() if v is not None})


def test_streams_and_reference(tmp_path: Path) -> None:
    write_trial(tmp_path / "a_trial.mat")
    trial = read_broad(tmp_path / "a_trial.mat")
    assert trial.name == "a_trial"
    # A sample's interval ends at the reference's instant; its stamp is the centre.
    np.testing.assert_allclose(trial.time - np.asarray(trial.inertial.time), 0.5 / RATE)
    np.testing.assert_allclose(np.asarray(trial.inertial.accelerometer)[:, 2], 9.81)
    expected = (np.arange(100) >= 30) & ~((np.arange(100) >= 40) & (np.arange(100) < 45))
    np.testing.assert_array_equal(trial.scored, expected)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"imu_gyr": None}, "lacks.*imu_gyr"),
        ({"imu_acc": np.zeros((99, 3))}, "imu_acc.*shape"),
        ({"opt_quat": np.zeros((100, 3))}, "opt_quat.*shape"),
        ({"sampling_rate": 0.0}, "sampling_rate"),
        ({"movement": np.zeros(100, bool)}, "no sample of the movement"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, changes: dict, message: str) -> None:
    write_trial(tmp_path / "trial.mat", **changes)
    with pytest.raises(InputError, match=message):
        read_broad(tmp_path / "trial.mat")


def test_missing_and_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_broad(tmp_path / "absent.mat")
    (tmp_path / "text.mat").write_text("not MATLAB")
    with pytest.raises(InputError, match="MATLAB"):
        read_broad(tmp_path / "text.mat")
