"""`batch` estimates recordings as `reconstruct` would, and goes on where it ended."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from mocap_jax.cli import estimate_recording
from mocap_jax.io import read_solution, write_recording

USAGE, SALVAGED = 2, 3
FILTER = ("--method", "ekf", "--sensors", "A,G")


@pytest.fixture
def folder(recording, tmp_path) -> Path:
    """Two recordings, one of them damaged, and one that is none."""
    (tmp_path / "in").mkdir()
    write_recording(tmp_path / "in" / "still.mcap", recording)
    whole = (tmp_path / "in" / "still.mcap").read_bytes()
    (tmp_path / "in" / "broken.mcap").write_bytes(b"no recording at all")
    (tmp_path / "in" / "short.mcap").write_bytes(whole[: int(0.8 * len(whole))])
    return tmp_path


def test_all_are_done_but_the_broken_one_and_not_again(run, folder):
    arguments = ["batch", folder / "in", "-o", folder / "out", "--workers", "0", *FILTER]
    first = run(*arguments, "--json", folder / "all.json")
    assert first.code == 1, first.err
    assert {p.name for p in (folder / "out").iterdir()} == {
        "still.solution.mcap", "still.json", "short.solution.mcap", "short.json", "broken.json",
        "summary.json", "summary.csv",
    }  # fmt: skip
    summary = json.loads((folder / "all.json").read_text())
    assert (summary["done"], summary["failed"], summary["salvaged"]) == (2, 1, 1)
    assert "broken: failed" not in first.out and "not an MCAP file" in first.out
    record = json.loads((folder / "out" / "still.json").read_text())
    assert record["frames"] == 181 and record["errors"]["orientation_error_mean_deg"]["mean"] < 5
    assert len(read_solution(folder / "out" / "still.solution.mcap").trajectory.time) == 181

    (folder / "in" / "broken.mcap").unlink()
    again = run(*arguments)
    assert again.code == SALVAGED and "2 of 2 are there already" in again.out
    (folder / "in" / "short.mcap").unlink()
    assert run(*arguments).code == 0


def test_other_options_are_estimated_anew(run, folder, monkeypatch):
    done = []
    monkeypatch.setattr("mocap_jax.cli.batch.work", lambda asked, source, target: (
        done.append((source.stem, asked.method)), target.write_text(""), {"status": "Done."},
    )[-1])  # fmt: skip
    arguments = ["batch", folder / "in" / "still.mcap", "-o", folder / "out", "--workers", "0"]
    for method in ("ekf", "ekf", "optimise"):
        assert run(*arguments, "--method", method).code == 0
    assert run(*arguments, "--method", "optimise", "--again").code == 0
    assert done == [("still", "ekf"), ("still", "optimise"), ("still", "optimise")]


def test_refining_starts_from_the_solutions_of_an_earlier_batch(run, folder, monkeypatch):
    filtered, refined = folder / "filtered", folder / "refined"
    source = folder / "in" / "still.mcap"
    assert run("batch", source, "-o", filtered, "--workers", "0", *FILTER).code == 0
    starts = []

    def solve(recording, body, *, initial, method, **options):
        starts.append((method, initial))
        return initial

    monkeypatch.setattr(estimate_recording, "solve", solve)
    arguments = ["batch", source, "-o", refined, "--workers", "0", "--initial", filtered]
    assert run(*arguments).code == 0
    ((method, initial),) = starts
    assert method == "optimise"
    wanted = read_solution(filtered / "still.solution.mcap")
    np.testing.assert_array_equal(initial.trajectory.q, wanted.trajectory.q)
    (filtered / "still.solution.mcap").unlink()
    outcome = run(*arguments)
    assert outcome.code == 1 and "nothing to start from" in outcome.out


def test_a_set_up_file_corrects_every_recording_and_is_part_of_what_was_done(run, folder):
    setup, out = folder / "s.toml", folder / "out"
    source = folder / "in" / "still.mcap"
    arguments = ["batch", source, "-o", out, "--workers", "0", *FILTER, "--setup", setup]
    entry = "[noise]\ngyroscope = 0.005\n[calibration.gyroscope.{}]\nzero = [{}, 0.0, 0.0]\n"
    found = {}
    for zero in (0.0, 0.2):
        setup.write_text(entry.format("chest", zero) + "[calibration.gyroscope.hat]\n")
        outcome = run(*arguments)
        assert outcome.code == 0 and "there already" not in outcome.out, outcome.err
        solution = read_solution(out / "still.solution.mcap")
        found[zero] = solution.calibration["gyroscope_bias/chest"]
        assert solution.setup.noise.gyroscope == 0.005 and solution.setup.calibration.applied
        warnings = json.loads((out / "still.json").read_text())["warnings"]
        assert any("s.toml: calibrates sensor hat, which is not worn" in text for text in warnings)
    np.testing.assert_allclose(found[0.2], found[0.0] - [0.2, 0.0, 0.0], atol=1e-3)
    assert "1 of 1 are there already" in run(*arguments).out
    setup.write_text("[noise]\ngyro = 1.0\n")
    outcome = run(*arguments)
    assert outcome.code == 1 and "s.toml" in outcome.err and "gyro" in outcome.err


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (["--workers", "2", "--scheduler", "tcp://a:1"], USAGE, ["--scheduler"]),
        (["--workers", "many"], USAGE, ["many"]), (["--method", "magic"], USAGE, ["magic", "ekf"]),
        (["--initial", "nowhere"], USAGE, ["not a folder of solutions"]),
        (["--body", "nowhere.xml"], 1, ["nowhere.xml: no such MJCF file"]),
        (["--method", "ekf", "--initial", "x"], USAGE, ["optimise or orientation"]),
    ],
)  # fmt: skip
def test_wrong_usage(run, recording_file, tmp_path, options, code, words):
    outcome = run("batch", recording_file, "-o", tmp_path / "out", *options)
    assert outcome.code == code and len(outcome.error_lines) == 1, outcome.err
    assert all(word in outcome.err for word in words), outcome.err


@pytest.mark.parametrize("verb", ["batch", "reconstruct"])
def test_help_says_which_methods_take_an_initial_solution(run, verb):
    text = " ".join(run(verb, "--help").out.split())
    assert "with --method optimise or orientation: start from" in text


def test_without_dask_one_line_says_what_to_install(refused, recording_file, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "distributed", None)
    out = recording_file.with_name("out")
    out.mkdir()
    refused(["batch", recording_file, "-o", out], 1, "mocap_jax[batch]", "--workers 0")


def test_warnings_of_a_recording_are_in_its_record(run, recording, tmp_path):
    board = recording.inertial["chest"]
    turned = dataclasses.replace(board, accelerometer=-np.asarray(board.accelerometer))
    boards = recording.inertial | {"chest": turned}
    write_recording(tmp_path / "a.mcap", dataclasses.replace(recording, inertial=boards))
    outcome = run("batch", tmp_path / "a.mcap", "-o", tmp_path / "out", "--workers", "0", *FILTER)
    assert outcome.code == 0 and not outcome.err, outcome.err
    record = json.loads((tmp_path / "out" / "a.json").read_text())
    assert "Sensor chest" in record["warnings"][0]


def _unread(*_: object, **__: object) -> None:
    raise AssertionError("recordings were read although results cannot be written")


def test_a_folder_below_a_file_is_refused_before_anything_is_read(
    refused, recording_file, monkeypatch
):
    monkeypatch.setattr("mocap_jax.batch.jobs_of", _unread)
    below = recording_file / "a" / "b"
    refused(["batch", recording_file, "-o", below], 1, str(below), "still.mcap' is none")


def test_a_locked_folder_is_refused_before_anything_is_read(
    refused, recording_file, tmp_path, monkeypatch
):
    monkeypatch.setattr("mocap_jax.batch.jobs_of", _unread)
    monkeypatch.setattr("mocap_jax.cli.files.os.access", lambda *_: False)  # root may write all
    out = tmp_path / "new" / "out"
    refused(["batch", recording_file, "-o", out], 1, "out: no permission", str(tmp_path))
