"""Six boards from the command line."""

from __future__ import annotations

import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.cli.exit_codes import SUCCESS
from mocap_jax.simulation import SUITS


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Two seconds of walking as a motion file."""
    motion = mj.builtin_motion("walking")
    path = motion.trajectory
    keep = (path.time >= 3.0) & (path.time < 5.0)
    file = tmp_path_factory.mktemp("clip") / "walk.npz"
    np.savez(
        file, time=path.time[keep] - path.time[keep][0], q=np.asarray(path.q)[keep],
        body_xml=np.array(motion.body.xml),
    )  # fmt: skip
    return file


def test_a_suit_by_name_and_orientations(run, clip, tmp_path):
    output = tmp_path / "six.mcap"
    arguments = ["simulate", clip, "--sensors", "sip6_head", "--orientations", "-o", output]
    assert run(*arguments).code == SUCCESS
    recording = mj.read_recording(output)
    assert set(recording.inertial) == set(SUITS["sip6_head"]) and not recording.setup.sources
    for board in recording.inertial.values():
        assert np.isfinite(np.asarray(board.orientation)).all()


def test_a_suit_that_does_not_exist(run, clip, tmp_path):
    result = run("simulate", clip, "--sensors", "sip7", "-o", tmp_path / "x.mcap")
    assert result.code != SUCCESS
    assert "sip7" in result.err and "sip6_head" in result.err and "Traceback" not in result.err
