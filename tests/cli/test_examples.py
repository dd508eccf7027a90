"""The example that `--help` gives runs as it stands, given the files it names."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import pytest

from mocap_jax.cli import main
from mocap_jax.cli.main import VERBS
from mocap_jax.io import write_recording

CHEAP = ("cut", "evaluate", "info", "export", "report", "view", "simulate", "convert")
COSTLY = {
    "demo": "tests/cli/test_demo.py", "decode": "tests/cli/test_decode.py",
    "place": "tests/cli/test_place.py", "reconstruct": "tests/cli/test_verbs.py",
    "batch": "tests/cli/test_batch.py", "calibrate": "tests/cli/test_calibrate_mounting.py",
}  # fmt: skip
"""Verbs whose examples take long, and what tests them on less."""


def test_every_verb_is_one_or_the_other():
    assert {*CHEAP, *COSTLY} == set(VERBS)
    here = Path(__file__).parents[2]
    assert all((here / file).is_file() for file in COSTLY.values())


@pytest.fixture(scope="module")
def prepared(recording, tmp_path_factory) -> Path:
    """Ten seconds of standing still, and their solution."""
    folder = tmp_path_factory.mktemp("examples")
    longer = lambda s: dataclasses.replace(s, time=s.time * (10 / 3))  # noqa: E731
    truth = dataclasses.replace(recording.truth, trajectory=longer(recording.truth.trajectory))
    walk = dataclasses.replace(
        recording, root=longer(recording.root), truth=truth,
        inertial={n: longer(s) for n, s in recording.inertial.items()},
    )  # fmt: skip
    write_recording(folder / "walk.mcap", walk)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["reconstruct", "walk.mcap", "--method", "ekf", "--sensors", "A,G"]) == 0
    return folder


@pytest.mark.parametrize("verb", CHEAP)
def test_the_example_runs(run, prepared, tmp_path, monkeypatch, request, verb):
    monkeypatch.chdir(tmp_path)
    if verb == "view":
        pytest.importorskip("rerun")
    if verb == "convert":
        source = request.getfixturevalue("shared_data") / "opensense_walking"
        if not source.is_dir():
            pytest.skip("the recording of OpenSense is absent")
        shutil.copytree(source, tmp_path, dirs_exist_ok=True)
    elif verb != "simulate":
        shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    program, *arguments = VERBS[verb].EXAMPLE.split()
    assert program == "mocap-jax"
    outcome = run(*arguments)
    assert outcome.code == 0, outcome.err
    for option in ("-o", "--json"):
        if option in arguments:
            assert (tmp_path / arguments[arguments.index(option) + 1]).stat().st_size > 0
