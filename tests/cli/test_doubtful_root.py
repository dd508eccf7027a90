"""A root that is too fast for anybody on foot is told, and estimated all the same."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mocap_jax.cli import estimate_recording
from mocap_jax.errors import InputError
from mocap_jax.io import write_recording


@pytest.mark.parametrize(("speed", "told"), [(1.4, False), (25.0, True)])
def test_a_vehicle_is_told(run, recording, tmp_path, monkeypatch, speed, told):
    def solve(*_, **__):
        raise InputError("reached the estimate")

    monkeypatch.setattr(estimate_recording, "solve", solve)
    path = tmp_path / "drive.mcap"
    position = np.outer(speed * recording.root.time, [1.0, 0.0, 0.0])
    root = dataclasses.replace(recording.root, position=position)
    write_recording(path, dataclasses.replace(recording, root=root))
    outcome = run("reconstruct", path, "-o", tmp_path / "a.mcap")
    assert "reached the estimate" in outcome.err
    assert ("warning" in outcome.err and "move at 25 m/s" in outcome.err) == told
    described = run("info", path)
    assert described.code == 0 and ("root: The root's positions" in described.out) == told
