"""Each verb does its job on a small recording, and says so in the documented form."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import jax
import numpy as np
import pytest

from mocap_jax.cli.main import VERBS, build_parser
from mocap_jax.cli.parser import sensor_kinds
from mocap_jax.cli.results import comparison_table, describe_solution
from mocap_jax.io import read_solution, write_recording
from mocap_jax.metrics import ErrorTable

SALVAGED = 3


@pytest.mark.parametrize("verb", VERBS)
def test_help_has_an_example_that_parses(run, verb):
    outcome = run(verb, "--help")
    assert outcome.code == 0 and not outcome.err
    example = VERBS[verb].EXAMPLE
    assert example in outcome.out
    program, *arguments = example.split()
    assert program == "mocap-jax"
    assert build_parser().parse_args(arguments).verb == verb


def test_top_help_lists_every_verb(run):
    outcome = run("--help")
    assert outcome.code == 0
    assert all(verb in outcome.out for verb in VERBS)


@pytest.mark.parametrize("text", ["A,G,D", "a g d", "AGD", "A, G,D,A"])
def test_sensor_kinds_are_read_in_the_usual_spellings(text):
    assert sensor_kinds(text) == "AGD"
    assert sensor_kinds("A,G,M") == "AGM"


def test_info_names_the_sensors(run, recording_file):
    outcome = run("info", recording_file)
    assert outcome.code == 0 and not outcome.err
    assert "pelvis" in outcome.out and "chest" in outcome.out


@pytest.fixture(scope="module")
def reconstructed(recording, tmp_path_factory) -> Path:
    """Folder with a filtered solution and its JSON results."""
    from mocap_jax.cli import main
    from mocap_jax.io import write_recording

    folder = tmp_path_factory.mktemp("reconstructed")
    write_recording(folder / "still.mcap", recording)
    arguments = ["reconstruct", "still.mcap", "--method", "ekf", "--sensors", "A,G"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main([*arguments, "--json", "still.json"]) == 0
    return folder


def test_reconstruct_writes_beside_the_recording(reconstructed):
    names = {path.name for path in reconstructed.iterdir()}
    assert names == {"still.mcap", "still.solution.mcap", "still.json"}


def test_gravity_reference_is_used_where_asked_for(run, recording_file, reconstructed, tmp_path):
    options = ["--method", "ekf", "--sensors", "G", "--gravity"]
    outcome = run("reconstruct", recording_file, *options)
    assert outcome.code == 0, outcome.err
    told = read_solution(tmp_path / "still.solution.mcap").statistics
    assert {"gravity/pelvis", "gravity/chest"} <= told.keys()
    assert told["gravity/chest"]["count"] > 300, "it stands still: nearly all frames, two values"
    without = read_solution(reconstructed / "still.solution.mcap").statistics
    assert not any("gravity" in name for name in without)


def test_json_has_the_documented_keys(reconstructed):
    content = json.loads((reconstructed / "still.json").read_text())
    assert isinstance(content["status"], str) and content["status"].endswith(".")
    assert content["frames"] == 181
    for key, kind in (("seconds_solve", float), ("seconds_compile", float), ("iterations", int)):
        assert isinstance(content[key], kind)
    assert isinstance(content["cost"], list)
    joints = content["errors"]["orientation_error_mean_deg"]
    assert joints.keys() >= {"T8", "mean", "mean_observed"}
    assert 0 <= joints["T8"] < 1.0, "at rest the inclination is known from gravity"
    assert content["observed"] == ["T8"]


def test_evaluate_repeats_the_errors_of_reconstruct(run, reconstructed, tmp_path):
    files = reconstructed / "still.solution.mcap", reconstructed / "still.mcap"
    outcome = run("evaluate", *files, "--json", tmp_path / "again.json")
    assert outcome.code == 0
    again = json.loads((tmp_path / "again.json").read_text())["errors"]
    first = json.loads((reconstructed / "still.json").read_text())["errors"]
    for metric, values in first.items():
        for joint, value in values.items():
            assert math.isclose(again[metric][joint], value, abs_tol=1e-6), (metric, joint)


def test_evaluate_against_itself_is_zero(run, reconstructed, tmp_path):
    solution = reconstructed / "still.solution.mcap"
    assert run("evaluate", solution, solution, "--json", tmp_path / "zero.json").code == 0
    errors = json.loads((tmp_path / "zero.json").read_text())["errors"]
    assert errors["orientation_error_mean_deg"]["mean"] < 1e-5


@pytest.mark.parametrize(
    "suffix", [".bvh", ".csv", ".npz", ".mot", ".sto", ".orientations.sto", ".trc"]
)
def test_export_writes_every_format(run, reconstructed, tmp_path, suffix):
    target = tmp_path / f"motion{suffix}"
    assert run("export", reconstructed / "still.solution.mcap", "-o", target).code == 0
    assert target.stat().st_size > 1000


def test_report_is_one_page(run, reconstructed, tmp_path):
    page = tmp_path / "report.html"
    files = reconstructed / "still.solution.mcap", "--recording", reconstructed / "still.mcap"
    outcome = run("report", *files, "-o", page)
    assert outcome.code == 0, outcome.err
    text = page.read_text(encoding="utf-8")
    assert "</html>" in text and "T8" in text
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_truncated_recording_gives_a_result_and_says_so(run, reconstructed, tmp_path):
    whole = (reconstructed / "still.mcap").read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: int(0.8 * len(whole))])
    outcome = run("reconstruct", path, "--method", "ekf", "--sensors", "A,G")
    assert outcome.code == SALVAGED, outcome.err
    assert len(outcome.error_lines) == 1
    assert outcome.err.startswith("mocap-jax: warning:") and "cut.mcap" in outcome.err
    assert (tmp_path / "cut.solution.mcap").is_file()
    assert run("info", path).code == SALVAGED


def test_traceback_only_when_asked_for(run, tmp_path):
    quiet = run("info", tmp_path / "nowhere.mcap")
    loud = run("info", tmp_path / "nowhere.mcap", "--traceback")
    assert "Traceback" not in quiet.err and "Traceback" in loud.err
    assert quiet.code == loud.code == 1


def test_suspicious_sensors_are_named(run, recording, tmp_path):
    """A board upside down: info says so, reconstruct warns and remarks, the exit code stays 0."""
    board = recording.inertial["chest"]
    flipped = dataclasses.replace(board, accelerometer=-np.asarray(board.accelerometer))
    path = tmp_path / "flipped.mcap"
    write_recording(
        path, dataclasses.replace(recording, inertial=recording.inertial | {"chest": flipped})
    )
    info = run("info", path)
    assert info.code == 0 and "sensor check: Sensor chest: gravity at rest is 180 deg" in info.out
    made = run("reconstruct", path, "--method", "ekf", "--sensors", "A,G")
    assert made.code == 0
    assert made.err.startswith("mocap-jax: warning:") and "Sensor chest" in made.err
    assert "Sensor chest" in made.out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda b: {"accelerometer": np.asarray(b.accelerometer) / 9.81}, "probably g"),
        (lambda b: {"time": np.asarray(b.time)[::-1]}, "time goes backwards"),
    ],
    ids=["unit", "time"],
)
def test_info_of_what_cannot_be_true_is_that_of_a_damaged_file(
    run, recording, tmp_path, change, words
):
    """`reconstruct` refuses such a recording; `info` still tells what is in it."""
    board = recording.inertial["chest"]
    wrong = {"chest": dataclasses.replace(board, **change(board))}
    path = tmp_path / "wrong.mcap"
    write_recording(path, dataclasses.replace(recording, inertial=recording.inertial | wrong))
    info = run("info", path)
    assert info.code == SALVAGED and not info.err
    assert f"fault: {path}: /inertial/chest: " in info.out and words in info.out
    assert "inertial sensors: 2" in info.out
    refused = run("reconstruct", path, "--method", "ekf")
    assert refused.code == 1 and words in refused.err


def test_info_of_a_broken_body(run, recording, tmp_path):
    path = tmp_path / "wrong.mcap"
    broken = recording.body_xml.replace("</worldbody>", "")
    write_recording(path, dataclasses.replace(recording, body_xml=broken))
    info = run("info", path)
    assert info.code == SALVAGED and "fault: " in info.out and "body.xml" in info.out


def test_info_without_a_body_is_sound(run, recording, tmp_path):
    path = tmp_path / "bodiless.mcap"
    write_recording(path, dataclasses.replace(recording, body_xml=None))
    assert run("info", path).code == 0


def test_info_explains_its_exit_codes(run):
    text = run("info", "--help").out
    assert "exit codes:" in text and all(f"\n  {code}  " in text for code in range(4))


def test_info_finds_nothing_suspicious(run, recording_file):
    assert "sensor check: nothing suspicious" in run("info", recording_file).out


def test_evaluate_warns_of_another_recording(run, recording, reconstructed, tmp_path):
    setup = dataclasses.replace(recording.setup, sensors=recording.setup.sensors[:1])
    other = tmp_path / "other.mcap"
    write_recording(other, dataclasses.replace(recording, setup=setup))
    outcome = run("evaluate", reconstructed / "still.solution.mcap", other)
    assert outcome.code == 0 and len(outcome.error_lines) == 1
    assert "do not seem to be of the same recording: the sensors differ (chest" in outcome.err
    own = run("evaluate", reconstructed / "still.solution.mcap", reconstructed / "still.mcap")
    assert not own.err


def foreign(recording, **provenance):
    """The recording with facts that tell it apart."""
    setup = dataclasses.replace(recording.setup, provenance=provenance)
    return dataclasses.replace(recording, setup=setup)


@pytest.mark.parametrize("verb", ["evaluate", "report"])
def test_a_foreign_reference_is_refused(run, recording, tmp_path, verb):
    write_recording(tmp_path / "stand.mcap", foreign(recording, motion="stand"))
    write_recording(tmp_path / "run.mcap", foreign(recording, motion="run"))
    solution = tmp_path / "stand.solution.mcap"
    options = ["--method", "ekf", "--sensors", "A,G"]
    assert run("reconstruct", tmp_path / "stand.mcap", *options).code == 0
    outputs = ["--json", tmp_path / "a.json"] if verb == "evaluate" else ["-o", tmp_path / "a.html"]
    reference = ["--recording"] * (verb == "report")
    outcome = run(verb, solution, *reference, tmp_path / "run.mcap", *outputs)
    assert outcome.code == 1 and len(outcome.error_lines) == 1 and not outcome.out
    assert outcome.err.startswith("mocap-jax: error:")
    for word in ("stand.solution.mcap", "run.mcap", "motion differs (stand here, run in the"):
        assert word in outcome.err
    assert not list(tmp_path.glob("a.*"))
    assert run(verb, solution, *reference, tmp_path / "stand.mcap", *outputs).code == 0


def test_a_reference_of_another_time_is_refused(run, recording, reconstructed, tmp_path):
    half = len(recording.truth.trajectory.time) // 2
    cut = lambda tree: jax.tree.map(lambda x: np.asarray(x)[:half], tree)  # noqa: E731
    short = dataclasses.replace(
        recording,
        inertial={name: cut(board) for name, board in recording.inertial.items()},
        root=cut(recording.root),
        truth=dataclasses.replace(recording.truth, trajectory=cut(recording.truth.trajectory)),
    )
    write_recording(tmp_path / "short.mcap", short)
    outcome = run("evaluate", reconstructed / "still.solution.mcap", tmp_path / "short.mcap")
    assert outcome.code == 1 and len(outcome.error_lines) == 1
    assert "of 181 frames lie outside the reference's time (0.00 s to 1.48 s)" in outcome.err


def test_a_reference_without_truth_is_refused(run, recording, reconstructed, tmp_path):
    write_recording(tmp_path / "blind.mcap", dataclasses.replace(recording, truth=None))
    outcome = run("evaluate", reconstructed / "still.solution.mcap", tmp_path / "blind.mcap")
    assert outcome.code == 1 and len(outcome.error_lines) == 1
    assert "blind.mcap: a recording without truth" in outcome.err


def test_comparison_explains_the_papers_joints():
    errors = {"orientation_error_mean_deg": {"mean": 2.0, "mean_table1": 1.0}}
    table = ErrorTable(errors, (), ("Head",), 10, (0.0, 1.0))
    text = comparison_table({"ekf": table})
    assert "neck, shoulder, hip [deg]" in text and "table 1 in Vlasic et al. 2007" in text


def test_comparison_has_one_row_a_joint_and_one_column_a_method():
    def table(error):
        values = {"RightHand": error, "Head": 2 * error, "mean": 1.5 * error}
        return ErrorTable(
            {"orientation_error_mean_deg": values | {"mean_observed": error}},
            ("RightHand",), (), 10, (0.0, 1.0),
        )  # fmt: skip

    text = comparison_table({"ekf": table(4.0), "ekf_smoothed": table(3.0), "optimise": table(1.0)})
    rows = {line[:30].strip(): line[30:].split() for line in text.splitlines()}
    assert rows["1 observed joints [deg]"] == ["ekf", "ekf_smoothed", "optimise"]
    assert rows["RightHand"] == ["4.000", "3.000", "1.000"]
    assert rows["mean of observed joints [deg]"] == ["4.000", "3.000", "1.000"]
    assert rows["mean of all joints [deg]"] == ["6.000", "4.500", "1.500"]
    assert text.count("RightHand") == 1 and "Head" not in rows
    assert "relative to the pelvis" in text and "Vlasic" not in text


def test_effort_counts_steps_of_all_rounds(reconstructed):
    solution = read_solution(reconstructed / "still.solution.mcap")
    assert "steps" not in describe_solution(solution)
    tried = dataclasses.replace(solution, iterations=41, options={"solver": {"max_iterations": 30}})
    assert "41 steps tried in all rounds (limit 30 a round)" in describe_solution(tried)
