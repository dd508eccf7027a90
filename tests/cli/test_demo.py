"""The demo: what it prints in a log, and what it leaves, on a small recording."""

from __future__ import annotations

import dataclasses
import io
import json
import re
import shutil

import pytest

from mocap_jax import estimate
from mocap_jax.cli import demo
from mocap_jax.cli.step_lines import StepLines

FILES = {"recording.mcap", "ekf.solution.mcap", "optimised.solution.mcap", "motion.bvh",
         "report.html", "metrics.json"}  # fmt: skip
METHODS = ["ekf", "ekf_smoothed", "optimise"]


def test_a_log_gets_a_line_a_step_and_one_table(run, recording_file, tmp_path, monkeypatch):
    def bundled(folder):
        return shutil.copyfile(recording_file, folder / "recording.mcap")

    def optimise(recording, *, initial, progress):
        """In place of the real one, which compiles for a minute."""
        del recording, progress
        return dataclasses.replace(initial, method="optimise")

    monkeypatch.setattr(demo, "copy_recording", bundled)
    monkeypatch.setattr(estimate, "optimise", optimise)
    outcome = run("demo", "-o", tmp_path / "demo")
    assert outcome.code == 0, outcome.err
    assert {p.name for p in (tmp_path / "demo").iterdir()} == FILES
    lines = outcome.out.splitlines()
    steps = [m for line in lines if (m := re.fullmatch(r"(\d)/6 [a-z ,:]+ \.\.\. \d+ s", line))]
    assert [m[1] for m in steps] == list("123456")
    heads = [line.split() for line in lines if line.split()[-3:] == METHODS]
    assert len(heads) == 1, "one table with the methods as columns"
    joints = [line.split() for line in lines if line.startswith("T8 ")]
    assert len(joints) == 1 and len(joints[0]) == 4
    metrics = json.loads((tmp_path / "demo" / "metrics.json").read_text())
    assert list(metrics) == METHODS
    errors = [metrics[m]["errors"]["orientation_error_mean_deg"]["T8"] for m in METHODS]
    assert [float(x) for x in joints[0][1:]] == pytest.approx(errors, abs=1e-3)


def test_a_step_is_named_before_it_is_done():
    stream = io.StringIO()
    steps = StepLines(2, shown=True, stream=stream)
    with steps.step("first"):
        assert stream.getvalue() == "1/2 first ..."
    assert stream.getvalue() == "1/2 first ... 0 s\n"
    with pytest.raises(ValueError, match="broken"), steps.step("second"):
        raise ValueError("broken")
    assert stream.getvalue().endswith("2/2 second ...\n")


def test_nothing_is_added_where_bars_are_seen():
    stream = io.StringIO()
    with StepLines(1, shown=False, stream=stream).step("only"):
        pass
    assert stream.getvalue() == ""
