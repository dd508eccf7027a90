"""Stretches on the command line: `cut`, `--from` and `--to`, `walking:0-3`."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.cli.stretch import named_stretch
from mocap_jax.io import read_recording, read_solution
from mocap_jax.motion import builtin_motion, cut_motion

USAGE = 2


def test_cut_writes_the_stretch(run, recording_file, tmp_path):
    outcome = run("cut", recording_file, "-o", tmp_path / "part.mcap", "--from", 0.5, "--to", 2)
    assert outcome.code == 0 and not outcome.err, outcome.err
    part = read_recording(tmp_path / "part.mcap")
    np.testing.assert_allclose(part.interval, (0.5, 2.0), atol=1e-6)
    assert (part.setup.rest.start, part.setup.rest.end) == (0.5, 1.0)
    assert len(part.inertial["chest"].time) == 91 == len(part.truth.trajectory.time)


def test_a_lost_rest_hold_is_told(run, recording_file, tmp_path):
    outcome = run("cut", recording_file, "-o", tmp_path / "part.mcap", "--from", 2)
    assert outcome.code == 0 and "rest hold (0 to 1 s) was cut away" in outcome.err


def test_reconstruct_a_stretch_and_compare_it_with_the_whole(run, recording_file, tmp_path):
    outcome = run(
        "reconstruct", recording_file, "--method", "ekf", "--sensors", "A,G",
        "--from", 0.5, "--to", 2,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    solution = recording_file.with_name("still.solution.mcap")
    time = read_solution(solution).trajectory.time
    assert time[0] >= 0.5 - 1e-6 and time[-1] <= 2.0 + 1e-6 and len(time) > 80
    outcome = run("evaluate", solution, recording_file)
    assert outcome.code == 0 and not outcome.err, "the same recording, not another"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--from", "5"], ["--from 5", "to 3.00 s"]),
        (["--from", "2", "--to", "1"], ["start must be before"]),
        (["--to", "soon"], ["'soon' is not a time"]), (["--from", "-1"], ["not a time"]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("verb", ["cut", "reconstruct"])
def test_wrong_stretches_are_wrong_usage(refused, recording_file, verb, options, words):
    output = ["-o", recording_file.with_name("out.mcap")]
    refused([verb, recording_file, *output, *options], USAGE, *words)


def test_cut_without_a_stretch_is_wrong_usage(refused, recording_file):
    output = recording_file.with_name("out.mcap")
    refused(["cut", recording_file, "-o", output], USAGE, "--from S, --to S or both")


def test_stretches_by_name(tmp_path, monkeypatch):
    assert named_stretch("walking:0-3") == ("walking", (0.0, 3.0))
    assert named_stretch("C:/clips/02_01.amc:0.5-12.25") == ("C:/clips/02_01.amc", (0.5, 12.25))
    for whole in ("walking", "C:/clips/02_01.amc", "a:b-c", "a-1:2.amc"):
        assert named_stretch(whole) == (whole, None)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clip:1-2").touch()
    assert named_stretch("clip:1-2") == ("clip:1-2", None), "a file of that name"


def test_motion_is_cut_and_starts_at_zero():
    whole = builtin_motion("walking")
    part = cut_motion(whole, 2.0, 3.5)
    step = float(whole.trajectory.time[1])
    first = int(np.searchsorted(whole.trajectory.time, 2.0 - 1e-9))
    assert part.trajectory.time[0] == 0.0
    assert abs(float(part.trajectory.time[-1]) - 1.5) < step
    np.testing.assert_array_equal(part.trajectory.q[0], whole.trajectory.q[first])
    assert part.name == "walking:2-3.5" and part.facts["cut_stop"] == 3.5


def test_simulate_a_stretch(run, tmp_path):
    output = tmp_path / "part.mcap"
    outcome = run("simulate", "walking:1-2.5", "-o", output, "--sensors", "sip6_head")
    assert outcome.code == 0, outcome.err
    assert "walking:1-2.5" in outcome.out
    setup = read_recording(output).setup
    assert read_recording(output).interval[1] - setup.score_from == pytest.approx(1.5, abs=0.05)


def test_simulate_refuses_a_stretch_beyond_the_end(refused, tmp_path):
    output = ["-o", tmp_path / "out.mcap"]
    refused(["simulate", "walking:50-60", *output], 1, "walking:50-60: no such stretch")
    refused(["simulate", "walking:3-1", *output], USAGE, "must end after it starts")
