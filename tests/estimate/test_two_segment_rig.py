"""Real data end to end: ten seconds of the public two-segment rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mocap_jax.estimate.two_segment_rig import estimate_rig, relative_error
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
