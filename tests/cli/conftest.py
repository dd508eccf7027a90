"""A small recording (two segments at rest, three seconds) and a way to run the command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import mocap_jax.motion
from mocap_jax.body import Body, load_body
from mocap_jax.cli import main
from mocap_jax.io import write_recording
from mocap_jax.motion import Motion
from mocap_jax.recording import (
    InertialStream,
    Recording,
    RestHold,
    RootStream,
    SensorSpec,
    Setup,
    Truth,
)
from mocap_jax.simulation import SimulationOptions
from mocap_jax.trajectory import Trajectory

BODY = """<mujoco>
  <worldbody>
    <body name="Pelvis" pos="0 0 1">
      <freejoint name="root"/>
      <geom type="box" size=".1 .1 .1"/>
      <site name="pelvis" pos="0 0 .05"/>
      <body name="T8" pos="0 0 .1">
        <joint name="T8" type="ball" pos="0 0 0"/>
        <geom type="box" size=".1 .1 .2"/>
        <site name="chest" pos="0 0 .3"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""
RATE, COUNT = 60.0, 181


@pytest.fixture(scope="session")
def recording() -> Recording:
    """Two boards on two segments that stand still, with their truth."""
    random = np.random.default_rng(3)
    time = np.arange(COUNT) / RATE
    body = load_body(BODY)

    def board() -> InertialStream:
        up = np.broadcast_to([0.0, 0.0, 9.81], (COUNT, 3))
        return InertialStream(
            time,
            up + 0.02 * random.standard_normal((COUNT, 3)),
            0.002 * random.standard_normal((COUNT, 3)),
            np.full((COUNT, 4), np.nan),
        )

    pose = np.asarray(body.qpos0)
    return Recording(
        inertial={"pelvis": board(), "chest": board()},
        ranges=None,
        root=RootStream(time, np.tile(pose[:3], (COUNT, 1)), np.tile(pose[3:7], (COUNT, 1))),
        magnetic={},
        temperature=None,
        truth=Truth(Trajectory(time, np.tile(pose, (COUNT, 1))), BODY),
        setup=Setup(
            sensors=tuple(SensorSpec(n, n, RATE) for n in ("pelvis", "chest")),
            rest=RestHold(0.0, 1.0, {}),
            score_from=1.0,
        ),
        body_xml=BODY,
    )


@pytest.fixture
def recording_file(recording: Recording, tmp_path: Path) -> Path:
    """The recording in a folder of its own."""
    path = tmp_path / "still.mcap"
    write_recording(path, recording)
    return path


@pytest.fixture
def nod(nodding_body: Body, monkeypatch: pytest.MonkeyPatch) -> str:
    """A short clip of two segments under the name of a built-in motion, and a short hold."""
    time = np.arange(60) / 60
    q = np.tile(np.asarray(nodding_body.qpos0), (len(time), 1))
    q[:, 0] += 0.05 * np.sin(4 * time)
    clip = Motion("nod", nodding_body, Trajectory(time, q))
    monkeypatch.setattr(mocap_jax.motion, "builtin_motion", lambda *_: clip)
    short = lambda **kw: SimulationOptions(rest_s=0.3, blend_s=0.4, **kw)  # noqa: E731
    monkeypatch.setattr("mocap_jax.simulation.SimulationOptions", short)
    return "routine"


@dataclass(frozen=True)
class Outcome:
    """What a run left behind."""

    code: int
    out: str
    err: str

    @property
    def error_lines(self) -> list[str]:
        return self.err.splitlines()


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]):
    """Run the command line in this process: `run("info", path) -> Outcome`."""

    def runner(*arguments: object) -> Outcome:
        capsys.readouterr()
        code = main([str(a) for a in arguments])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return runner


@pytest.fixture
def refused(run, tmp_path: Path):
    """Run, and check that it is refused on one line that holds the given words."""

    def check(arguments: list[object], code: int, *words: str) -> None:
        before = sorted(tmp_path.rglob("*"))
        outcome = run(*arguments)
        assert outcome.code == code, outcome
        assert len(outcome.error_lines) == 1, outcome.err
        assert "Traceback" not in outcome.err and "unexpected" not in outcome.err, outcome.err
        assert outcome.err.startswith("mocap-jax")
        for word in words:
            assert word in outcome.err, outcome.err
        assert sorted(tmp_path.rglob("*")) == before, "something was left behind"

    return check
