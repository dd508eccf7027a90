"""A measured root without orientations, or without positions, is used for what it has."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mocap_jax.io import read_solution, write_recording

AWAY = np.array([3.0, -2.0, 1.4])
"""Where the root was measured, metres from where the body model has it."""
TURNED = np.array([np.cos(0.5), 0.0, 0.0, np.sin(0.5)])


@pytest.mark.parametrize("missing", ["orientation", "position"])
def test_half_a_root_counts_as_given(run, recording, tmp_path, missing):
    n = len(recording.root.time)
    root = dataclasses.replace(
        recording.root, position=np.tile(AWAY, (n, 1)), orientation=np.tile(TURNED, (n, 1))
    )
    root = dataclasses.replace(root, **{missing: np.full_like(getattr(root, missing), np.nan)})
    path, output = tmp_path / "half.mcap", tmp_path / "half.solution.mcap"
    write_recording(path, dataclasses.replace(recording, root=root))
    outcome = run(
        "reconstruct", path, "-o", output, "--root", "given", "--method", "ekf", "--sensors", "A,G"
    )
    assert outcome.code == 0, outcome.err
    q = np.asarray(read_solution(output).trajectory.q)
    if missing == "orientation":
        np.testing.assert_allclose(q[:, :3], np.tile(AWAY, (n, 1)), atol=0.01)
    else:
        assert np.abs(q[:, 3:7] @ TURNED).min() > np.cos(0.01)
