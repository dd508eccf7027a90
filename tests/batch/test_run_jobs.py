"""Jobs are done once, their failures stay their own, and a second run goes on."""

from __future__ import annotations

import csv
import io
import json
import os
from pathlib import Path

import pytest
from small_work import copy_work

from mocap_jax.batch import Summary, jobs_of, run_jobs
from mocap_jax.batch.summary import COLUMNS
from mocap_jax.errors import InputError

OPTIONS = {"method": "ekf", "version": "1"}


def write(folder: Path, **texts: str) -> list[Path]:
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / f"{name}.mcap").write_text(text)
    return [folder / f"{name}.mcap" for name in texts]


def jobs(inputs: list[Path], folder: Path, **options: str):
    folder.mkdir(exist_ok=True)
    return jobs_of(inputs, folder, OPTIONS | options)


def test_failures_are_records_and_stop_no_other(tmp_path):
    files = write(tmp_path / "in", a="one", b="wrong", c="odd", d="failed", e="damaged")
    told = []
    out = tmp_path / "out"
    records = run_jobs(
        jobs(files, out), copy_work, workers=0, done=lambda job, r: told.append(job.source.name)
    )
    assert told == ["a.mcap", "b.mcap", "c.mcap", "d.mcap", "e.mcap"]
    assert [r["failed"] for r in records] == [
        None, f"{files[1].absolute()}: is wrong", "ZeroDivisionError: by zero",
        "Failed: non-finite.", None,
    ]  # fmt: skip
    assert [r["solution"] and Path(r["solution"]).name for r in records] == [
        "a.solution.mcap", None, None, None, "e.solution.mcap",
    ]  # fmt: skip
    for record in records:
        assert json.loads((out / f"{Path(record['source']).stem}.json").read_text()) == record
    assert not list(out.glob(".*"))


def test_only_what_changed_is_done_again(tmp_path):
    files, out = write(tmp_path / "in", a="one", b="two", c="wrong"), tmp_path / "out"
    unfinished = lambda **o: [j.source.stem for j in jobs(files, out, **o) if not j.finished]  # noqa: E731
    assert unfinished() == ["a", "b", "c"]
    run_jobs(jobs(files, out), copy_work, workers=0)
    assert unfinished() == ["c"], "the failed one is tried again"
    assert unfinished(method="optimise") == ["a", "b", "c"], "other options"
    files[1].write_text("three")
    assert unfinished() == ["b", "c"], "another content"
    (out / "a.solution.mcap").unlink()
    assert unfinished() == ["a", "b", "c"], "its solution is gone"
    (out / "b.json").write_text("{")
    assert "b" in unfinished(), "a damaged record"


def test_further_files_count(tmp_path):
    files, out = write(tmp_path / "in", a="one", b="two"), tmp_path / "out"
    body, start = tmp_path / "body.xml", tmp_path / "a.solution.mcap"
    body.write_text("1")
    start.write_text("1")
    prints = lambda: [  # noqa: E731
        j.fingerprint for j in jobs_of(files, out, OPTIONS, more={"": [body], "a": [start]})
    ]
    first = prints()
    start.write_text("2")
    second = prints()
    assert first[0] != second[0] and first[1] == second[1]
    body.write_text("2")
    assert all(x != y for x, y in zip(second, prints(), strict=True))


def test_folders_hold_recordings_and_solutions_are_none(tmp_path):
    files = write(tmp_path / "in", b="x", a="y")
    (tmp_path / "in" / "a.solution.mcap").write_text("z")
    (tmp_path / "in" / "notes.txt").write_text("z")
    found = jobs([tmp_path / "in", files[0]], tmp_path / "out")
    assert [j.source.stem for j in found] == ["a", "b"], "each once"


def test_wrong_inputs(tmp_path):
    one, two = write(tmp_path / "in", a="x")[0], write(tmp_path / "more", a="y")[0]
    with pytest.raises(InputError, match="would be called as those of"):
        jobs([one, two], tmp_path / "out")
    with pytest.raises(InputError, match="nowhere.mcap: no such file"):
        jobs([tmp_path / "nowhere.mcap"], tmp_path / "out")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no recordings"):
        jobs([tmp_path / "empty"], tmp_path / "out")


def test_side_by_side_in_worker_processes(tmp_path):
    """A worker that dies takes its own job with it and no other."""
    pytest.importorskip("distributed")
    files = write(tmp_path / "in", a="one", b="wrong", c="deadly", d="two")
    records = run_jobs(jobs(files, tmp_path / "out"), copy_work, workers=2)
    assert [Path(r["source"]).stem for r in records] == ["a", "b", "c", "d"], "the order of jobs"
    assert records[0]["process"] != os.getpid()
    assert "is wrong" in records[1]["failed"]
    assert "its worker process ended" in records[2]["failed"]
    assert [r["status"] for r in (records[0], records[3])] == ["Copied one.", "Copied two."]


def test_a_scheduler_that_is_not_there(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    from mocap_jax.batch import run

    monkeypatch.setattr(run, "_PATIENCE", "1s")
    files = write(tmp_path / "in", a="one")
    with pytest.raises(InputError, match=r"--scheduler tcp://127.0.0.1:9: no Dask scheduler"):
        run_jobs(jobs(files, tmp_path / "out"), copy_work, scheduler="tcp://127.0.0.1:9")


def test_summary_counts_and_tells(tmp_path):
    files = write(tmp_path / "in", a="one", b="wrong", c="damaged")
    records = run_jobs(jobs(files, tmp_path / "out"), copy_work, workers=0)
    summary = Summary(tuple(records), frozenset([records[0]["source"]]))
    content = summary.as_json()
    counts = [content[k] for k in ("recordings", "done", "already_done", "failed", "salvaged")]
    assert counts == [3, 1, 1, 1, 1]
    assert [r["outcome"] for r in content["results"]] == [
        "already done",
        "failed",
        "done, salvaged",
    ]
    rows = list(csv.DictReader(io.StringIO(summary.as_csv())))
    assert tuple(rows[0]) == COLUMNS
    assert [row["orientation_error_mean_deg"] for row in rows] == ["2.0", "", "2.0"]
    text = str(summary)
    assert "3 recordings: 1 done, 1 already done, 1 failed" in text and "is wrong" in text
