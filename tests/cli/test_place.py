"""`mocap-jax place`: its files, its table and its one-line errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mocap_jax import placement
from mocap_jax.cli.main import main
from mocap_jax.simulation import load_suit

ARGUMENTS = (
    "-n", "1", "--most", "1", "--evaluations", "2", "--restarts", "1", "--steps", "0",
    "--allow", "T8,Head",
)  # fmt: skip


@pytest.mark.slow
def test_study_is_written(tmp_path: Path, capsys: pytest.CaptureFixture):
    folder = tmp_path / "out"
    assert main(["place", "walking:2-3", "-o", str(folder), *ARGUMENTS]) == 0
    text = capsys.readouterr().out
    assert "exhaustive" in text and "rank" in text
    record = json.loads((folder / "study.json").read_text())
    assert {p["segments"][0] for p in record["placements"]} == {"T8", "Head"}
    for rank in (1, 2):
        suit = load_suit(folder / f"placement{rank}.toml")
        assert len(suit.boards) == 1
        assert (folder / f"placement{rank}.xml").read_text().count(suit.boards[0].name)
    assert (folder / "placement.png").is_file()
    assert not list(folder.glob(".*"))


@pytest.mark.slow
def test_what_a_study_writes_is_simulated_and_reconstructed(
    tmp_path: Path, capsys: pytest.CaptureFixture
):
    """With sources, noise of a file's own, and orientations asked for."""
    noise, folder = tmp_path / "noise.toml", tmp_path / "out"
    noise.write_text("[noise]\ngyroscope = 0.01\n")
    asked = ("--quantity", "orientation", "--setup", str(noise), "--sources", "1")
    assert main(["place", "walking:2-3", "-o", str(folder), *ARGUMENTS, *asked]) == 0
    text = capsys.readouterr().out
    assert "expected error [deg]" in text
    assert "sources of placement 1, by the mean squared error of joint centres" in text
    record = json.loads((folder / "study.json").read_text())
    suit = load_suit(folder / "placement1.toml")
    assert [s.name for s in suit.sources] == record["sources"]["chosen"]
    assert record["sources"]["with_all_cm"] <= record["sources"]["without_distances_cm"]
    walk = str(tmp_path / "walk.mcap")
    worn = ["--sensors", str(folder / "placement1.toml")]
    assert main(["simulate", "walking:0-1", "-o", walk, *worn]) == 0
    solved = ["reconstruct", walk, "--body", str(folder / "placement1.xml"), "--method", "ekf"]
    assert main([*solved, "-o", str(tmp_path / "walk.solution.mcap")]) == 0


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["walk"], 1, "walk: neither a file nor a built-in motion; built in: routine, walking"),
        (["walking:90-95"], 1, "walking:90-95: no such stretch; the motion lasts 10"),
        (["walking", "--objective", "B"], 2, "objective 'B'"),
        (["walking", "--cost", "Head"], 2, "--cost Head: expected SEGMENT=COST"),
        (["walking:2-3", "--allow", "Tail"], 2, "--allow: unknown segment 'Tail'"),
        (["walking:2-3", "--hub", "Tail", "--wire", "3"], 2, "--hub: unknown segment 'Tail'"),
        (["walking", "--quantity", "angle"], 2, "--quantity: unknown quantity 'angle'"),
        (["walking:2-3", "--joints", "Tail"], 2, "--joints: unknown joint 'Tail'; valid: L5"),
        (["walking:2-3", "--sources", "9"], 2, "--sources 9: more than the 8 of the standard"),
        (["walking:2-3", "--setup", "none.toml"], 1, "none.toml"),
        (["walking:2-3", "--hub", "Pelvis"], 2, "--hub: nothing without --wire"),
        (["walking:2-3", "-n", "40"], 2, "--number 40: more than the 21 segments"),
    ],
)
def test_wrong_input_gives_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture, arguments: list[str], code: int, message: str
):
    assert main(["place", *arguments, "-o", str(tmp_path / "out")]) == code
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1


def test_a_distance_that_no_choice_keeps_names_its_option(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
):
    def refused(*_: object, **__: object) -> None:
        raise placement.DistanceError("distance_m 0.3: no choice of 2 segments was found")

    monkeypatch.setattr(placement, "place", refused)
    arguments = ["place", "walking:2-3", "-n", "2", "--distance", "0.3"]
    assert main([*arguments, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "--distance: distance_m 0.3: no choice of 2" in error and error.count("\n") == 1
