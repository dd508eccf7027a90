"""`simulate --raw` and `decode`, on two segments that turn for a second and a half."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mocap_jax.motion
from mocap_jax.body import load_body
from mocap_jax.io import read_recording
from mocap_jax.motion import Motion
from mocap_jax.simulation import SimulationOptions
from mocap_jax.trajectory import Trajectory

BODY = """<mujoco>
  <worldbody>
    <body name="Pelvis" pos="0 0 1">
      <freejoint name="root"/>
      <geom type="capsule" size=".1" fromto="0 -.1 0 0 .1 0"/>
      <body name="T8" pos="0 0 .3">
        <joint name="T8" type="ball"/>
        <geom type="capsule" size=".1" fromto="0 -.1 .1 0 .1 .1"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""


@pytest.fixture
def motion(monkeypatch) -> Path:
    """A clip under the name of a built-in motion, and a short hold in front of it."""
    body = load_body(BODY)
    time = np.arange(60) / 60
    q = np.tile(np.asarray(body.qpos0), (len(time), 1))
    q[:, 0] += 0.05 * np.sin(4 * time)
    clip = Motion("nod", body, Trajectory(time, q))
    monkeypatch.setattr(mocap_jax.motion, "builtin_motion", lambda *_: clip)
    short = lambda **kw: SimulationOptions(rest_s=0.3, blend_s=0.4, **kw)  # noqa: E731
    monkeypatch.setattr("mocap_jax.simulation.SimulationOptions", short)
    return Path("routine")


def test_simulated_wires_are_decoded(run, motion, tmp_path):
    raw, out = tmp_path / "nod.raw.mcap", tmp_path / "nod.mcap"
    made = run("simulate", motion, "--raw", "-o", raw)
    assert made.code == 0, made.err
    assert "raw" in made.out and "boards" in made.out
    for detector in ("matched", "inflection"):
        outcome = run("decode", raw, "-o", out, "--detector", detector)
        assert outcome.code == 0, outcome.err
        assert f"detector {detector}" in outcome.out and "0 lost" in outcome.out
    recording = read_recording(out)
    assert recording.truth is not None and recording.root is not None
    assert recording.setup.provenance["detector"] == "inflection"
    first = next(iter(recording.inertial.values()))
    assert np.asarray(first.accelerometer).shape[0] > 150
    assert len(recording.ranges.time) > 20


def test_decode_takes_the_air_and_names_gaps(run, motion, tmp_path):
    raw, out = tmp_path / "nod.raw.mcap", tmp_path / "nod.mcap"
    assert run("simulate", motion, "--raw", "-o", raw).code == 0
    outcome = run("decode", raw, "-o", out, "--temperature", "30", "--humidity", "60")
    assert outcome.code == 0 and "no samples" not in outcome.out
    assert 350 < read_recording(out).setup.speed_of_sound < 352
    for option, value in (("--humidity", "101"), ("--temperature", "300")):
        outcome = run("decode", raw, "-o", out, option, value)
        assert outcome.code == 2 and option in outcome.err and "from" in outcome.err


def test_wrong_detector_and_wrong_file_say_what_is_valid(run, recording_file, tmp_path):
    out = tmp_path / "out.mcap"
    outcome = run("decode", recording_file, "-o", out, "--detector", "peak")
    assert outcome.code == 2 and "matched, inflection" in outcome.err
    outcome = run("decode", recording_file, "-o", out)
    assert outcome.code == 1 and "not a raw recording" in outcome.err
    outcome = run("decode", tmp_path / "absent.mcap", "-o", out)
    assert outcome.code == 1 and "No such file" in outcome.err
    assert not out.exists()


def test_orientations_cannot_be_sent(run, tmp_path):
    outcome = run("simulate", "routine", "--raw", "--orientations", "-o", tmp_path / "a.mcap")
    assert outcome.code == 2 and "--orientations" in outcome.err
