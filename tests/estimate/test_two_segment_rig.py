"""Real data end to end: ten seconds of the public two-segment rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mocap_jax.estimate.rig_reference import optical_arms
from mocap_jax.estimate.two_segment_rig import estimate_rig, estimate_unknown_rig, relative_error
from mocap_jax.initialise import find_joint
from mocap_jax.io.two_segment_rig import read_two_segment_rig


def test_ten_seconds_of_a_trial(shared_data: Path) -> None:
    file = shared_data / "two_segment_rig" / "data_1D_01.mat"
    if not file.is_file():
        pytest.skip(f"{file} is absent")
    trial = read_two_segment_rig(file, seconds=10.0)
    solution = estimate_rig(trial)
    assert solution.status.ok
    relative = np.asarray(solution.trajectory.q)[:, 7:11]
    assert relative_error(trial, relative) < 2.0


def test_ten_seconds_with_nothing_known(shared_data: Path) -> None:
    file = shared_data / "two_segment_rig" / "data_1D_01.mat"
    if not file.is_file():
        pytest.skip(f"{file} is absent")
    trial = read_two_segment_rig(file, seconds=10.0)
    finding, solution = estimate_unknown_rig(trial)
    assert solution.status.ok and finding.kind == "hinge"
    assert relative_error(trial, np.asarray(solution.trajectory.q)[:, 7:11]) < 2.0
    assert abs(finding.first_axis[1]) > 0.99 and abs(finding.second_axis[1]) > 0.99


@pytest.mark.parametrize(
    ("name", "kind"), [("1D_01", "hinge"), ("2D_01", "universal"), ("3D_01", "ball")]
)
def test_kinds_and_arms_of_the_trials(shared_data: Path, name: str, kind: str) -> None:
    """Within 5 mm of the arms that the optical orientations ask for."""
    file = shared_data / "two_segment_rig" / f"data_{name}.mat"
    if not file.is_file():
        pytest.skip(f"{file} is absent")
    trial = read_two_segment_rig(file)
    finding = find_joint(trial.recording, "first", "second")
    assert finding.kind == kind and finding.explained > 0.95
    off = np.stack([finding.first_arm, finding.second_arm]) - optical_arms(trial)
    off = off.ravel() - finding.undetermined.T @ (finding.undetermined @ off.ravel())
    assert np.linalg.norm(off.reshape(2, 3), axis=1).max() < 0.005
