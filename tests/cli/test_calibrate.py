"""`calibrate`: tables, set-up files, and what the other verbs make of them."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "calibration"))
from calibration_rig import (
    left_alone,
    measured_distances,
    six_positions,
    truth,
    turntable,
)

from mocap_jax.cli.calibrate import KINDS
from mocap_jax.cli.main import build_parser
from mocap_jax.cli.setup_choice import strangers
from mocap_jax.io import (
    SetupFigures,
    read_recording,
    read_setup,
    read_setup_figures,
    write_recording,
)
from mocap_jax.recording import (
    Calibration,
    Setup,
    SourceOffset,
    uncalibrated,
    with_calibration,
)


@pytest.fixture
def bench(tmp_path) -> dict[str, Path]:
    """Calibration recordings as files."""
    made = {
        "six": six_positions(), "turns": turntable(), "still": left_alone(),
        "near": measured_distances()[0],
    }  # fmt: skip
    files = {name: tmp_path / f"{name}.mcap" for name in made}
    for name, recording in made.items():
        write_recording(files[name], recording)
    return files


def table(folder: Path) -> Path:
    lines = ["source, receiver, true_m"]
    lines += [f"{s}, {r}, {d:.6f}" for (s, r), d in measured_distances()[1].items()]
    file = folder / "distances.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


def test_every_kind_has_help_with_an_example_that_parses(run):
    for module in KINDS:
        name = module.__name__.rsplit("_", 1)[1]
        outcome = run("calibrate", name, "--help")
        assert outcome.code == 0 and not outcome.err
        example = next(
            x.strip() for x in outcome.out.splitlines() if x.startswith("  mocap-jax calibrate")
        )
        arguments = build_parser().parse_args(example.split()[1:])
        assert arguments.kind == name and arguments.calibrate
        assert (
            build_parser().parse_args(["calibrate", *example.split()[2:], "--traceback"]).traceback
        )


def test_all_kinds_complete_one_set_up_file(run, bench, tmp_path):
    setup = tmp_path / "setup.toml"
    setup.write_text('# our suit\nspeed_of_sound = 345.0  # warm\n[provenance]\nowner = "lab"\n')
    for arguments in (
        ("accelerometer", bench["six"]),
        ("gyroscope", bench["turns"], "--json", tmp_path / "g.json"),
        ("noise", bench["still"], "--plot", tmp_path / "a.png", "--json", tmp_path / "n.json"),
        ("offsets", table(tmp_path), bench["near"], "--json", tmp_path / "o.json"),
    ):
        outcome = run("calibrate", *arguments, "-o", setup)
        assert outcome.code == 0 and not outcome.err, outcome
        assert f"wrote {setup}" in outcome.out and "+-" in outcome.out
    assert setup.read_text().startswith("# our suit\nspeed_of_sound = 345.0  # warm\n")
    read = read_setup(setup)
    assert read.speed_of_sound == 345.0 and read.provenance == {"owner": "lab"}
    assert read.noise.accelerometer == pytest.approx(0.04, rel=0.03)
    assert read.noise.range == pytest.approx(0.0025, rel=0.2)
    calibration = read.calibration
    for kind, recording in (("accelerometer", six_positions()), ("gyroscope", turntable())):
        for board in ("straight", "turned"):
            zero, slope = truth(recording, kind, board)
            found = getattr(calibration, kind)[board]
            np.testing.assert_allclose(found.slope, slope, atol=1e-3)
            np.testing.assert_allclose(found.zero, zero, atol=1e-2)
    assert set(calibration.source_offset) == {"source/left", "source/right"}
    assert set(calibration.gyroscope_noise) == {"straight", "turned"}
    assert (tmp_path / "a.png").stat().st_size > 10_000
    results = {k: json.loads((tmp_path / f"{k}.json").read_text()) for k in "gno"}
    assert results["g"]["sensors"]["turned"]["slope"] == list(calibration.gyroscope["turned"].slope)
    assert len(results["o"]["distances"]) == 10
    assert results["n"]["gyroscope"]["turned"]["duration_s"] > 60


SUIT = """
[[boards]]
name = "pelvis"
segment = "Pelvis"
position = [0.15, 0.0, 0.0]
orientation = [0.7071067811865476, 0.0, -0.7071067811865476, 0.0]
[[boards]]
name = "chest"
segment = "T8"
position = [0.15, 0.0, 0.1]
[[sources]]
name = "belly"
segment = "Pelvis"
position = [0.12, 0.05, 0.0]
orientation = [0.7071067811865476, 0.0, -0.7071067811865476, 0.0]
"""
FIGURES = """
[noise]
gyroscope = 0.003
[calibration.accelerometer.chest]
zero = [0.5, 0.0, -0.5]
slope = [1.05, 1.0, 0.95]
[calibration.gyroscope.chest]
zero = [0.2, 0.0, 0.0]
[calibration.source_offset."source/belly"]
offset = 0.03
"""


def test_simulate_errs_by_the_set_up_and_reconstruct_corrects_it(run, nod, tmp_path):
    ideal, wrong, setup = tmp_path / "ideal.mcap", tmp_path / "wrong.mcap", tmp_path / "suit.toml"
    made = ("simulate", "routine", "--seed", 3, "--sensors", setup)
    setup.write_text(SUIT)
    assert run(*made, "-o", ideal).code == 0
    setup.write_text(SUIT + FIGURES)
    outcome = run(*made, "-o", wrong)
    assert outcome.code == 0 and not outcome.err, outcome.err
    exact, read = read_recording(ideal), read_recording(wrong)
    assert read.setup.calibration.applied and read.setup.noise.gyroscope == 0.003
    force = np.asarray(exact.inertial["chest"].accelerometer)
    np.testing.assert_allclose(read.inertial["chest"].accelerometer, force, atol=1e-9)
    np.testing.assert_allclose(read.ranges.distance, exact.ranges.distance, atol=1e-9)
    raw = uncalibrated(read)
    expected = force * [1.05, 1.0, 0.95] + [0.5, 0.0, -0.5]
    np.testing.assert_allclose(raw.inertial["chest"].accelerometer, expected, atol=1e-9)
    np.testing.assert_allclose(raw.ranges.distance, exact.ranges.distance + 0.03, atol=1e-9)
    assert read.truth.parameters["accelerometer_scale/chest"] == pytest.approx(np.ones(3))
    # A recording that says nothing of it is corrected by --setup.
    bare = tmp_path / "bare.mcap"
    write_recording(bare, replace(raw, setup=exact.setup))
    errors = {}
    for name, more in (("corrected", ("--setup", setup)), ("as read", ())):
        out = ("-o", tmp_path / "out.mcap", "--json", tmp_path / "f.json")
        outcome = run("reconstruct", bare, "--method", "ekf", "--sensors", "A,G", *more, *out)
        assert outcome.code == 0, outcome.err
        found = json.loads((tmp_path / "f.json").read_text())["errors"]
        errors[name] = found["orientation_error_mean_deg"]["mean_observed"]
    assert errors["corrected"] < 0.5 * errors["as read"]


def test_decoded_recordings_are_corrected(run, nod, tmp_path):
    setup, raw = tmp_path / "suit.toml", tmp_path / "nod.raw.mcap"
    setup.write_text(SUIT + FIGURES)
    outcome = run("simulate", "routine", "--raw", "--sensors", setup, "-o", raw)
    assert outcome.code == 0 and not outcome.err, outcome.err
    decoded = tmp_path / "nod.mcap"
    assert run("decode", raw, "-o", decoded).code == 0
    recording = read_recording(decoded)
    assert recording.setup.calibration.applied
    at_rest = lambda r: np.median(r.inertial["chest"].accelerometer[:30], axis=0)  # noqa: E731
    np.testing.assert_allclose(at_rest(recording), [0, 0, 9.81], atol=0.05)
    expected = [0.5, 0, 9.81 * 0.95 - 0.5]
    np.testing.assert_allclose(at_rest(uncalibrated(recording)), expected, atol=0.05)
    # --setup replaces what the raw recording says.
    other = tmp_path / "other.toml"
    other.write_text("[calibration.accelerometer.chest]\nzero = [1.5, 0.0, -0.5]\n"
                     "slope = [1.05, 1.0, 0.95]\n")  # fmt: skip
    assert run("decode", raw, "--setup", other, "-o", decoded).code == 0
    np.testing.assert_allclose(at_rest(read_recording(decoded)), [-1 / 1.05, 0, 9.81], atol=0.05)


def test_names_that_nobody_bears_are_told(run, recording_file, tmp_path):
    setup = tmp_path / "s.toml"
    setup.write_text("[calibration.gyroscope.chst]\nzero = [0.1, 0.0, 0.0]\n")
    outcome = run("reconstruct", recording_file, "--setup", setup, "--method", "ekf")
    assert outcome.code == 0
    assert (
        "s.toml: calibrates sensor chst, which is not worn; there are: pelvis, chest" in outcome.err
    )


def test_sources_without_their_prefix_are_no_strangers():
    offsets = {name: SourceOffset(0.01) for name in ("belly", "source/belly", "anchor/wall", "hat")}
    figures = SetupFigures(Calibration(source_offset=offsets))
    told = strangers("s.toml", figures, Setup(sources=("source/belly", "anchor/wall")), ())
    assert told == (
        "s.toml: calibrates source hat, which is not worn; there are: source/belly, anchor/wall",
    )


def test_wrong_input_is_one_line(refused, bench, recording_file, tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text("[noise]\ngyro = 1.0\n")
    refused(["calibrate"], 2, "KIND")
    refused(["calibrate", "gyro", recording_file], 2, "offsets", "gyroscope")
    refused(["calibrate", "noise", tmp_path / "no.mcap"], 1, "no.mcap")
    refused(["calibrate", "noise", recording_file], 1, "still.mcap", "pelvis", "60 s")
    refused(["calibrate", "noise", bench["still"], "-o", bad], 1, "bad.toml", "gyro", "gyroscope")
    refused(["calibrate", "noise", bench["still"], "-o", tmp_path / "s.txt"], 2, ".txt", ".toml")
    refused(["calibrate", "noise", bench["still"], "--plot", tmp_path / "a.gif"], 2, ".gif", ".png")
    refused(["calibrate", "accelerometer", recording_file], 1, "still.mcap", "-x", "+y")
    refused(["calibrate", "gyroscope", bench["six"], "--rpm", "0"], 2, "--rpm")
    refused(["calibrate", "gyroscope", bench["six"]], 1, "six.mcap", "no steady turn")
    refused(["reconstruct", recording_file, "--setup", bad], 1, "bad.toml", "gyro")
    refused(["decode", recording_file, "--setup", bad, "-o", tmp_path / "x.mcap"], 1, "bad.toml")
    absent, out = tmp_path / "none.toml", tmp_path / "x.mcap"
    refused(["simulate", "walking", "--setup", absent, "-o", out], 1, "none.toml", "no such")
    assert bad.read_text() == "[noise]\ngyro = 1.0\n"


@pytest.mark.parametrize(("text", "words"), [
    ("source, true\n", ("unknown column 'true'", "true_m")),
    ("source, measured_m\n", ("no column 'true_m'", "columns: source, true_m")),
    ("source, true_m\n", ("no distances",)),
    ("source, true_m\nleft, 1\n", ("no column 'measured_m'",)),
    ("source, true_m, measured_m\nleft, 1\n", ("line 2 has 2 entries, the heading 3",)),
    ("source, true_m, measured_m\nleft, one, 1\n", ("line 2: true_m 'one' is not a number",)),
    ("source, true_m, measured_m\nleft, -1, 1\n", ("line 2", "'left'", "not above zero")),
    ("\nsource, true_m, measured_m\n\n,,\nleft, one, 1\n", ("line 5: true_m 'one'",)),
    ("source, true_m, measured_m\nleft, 1, \n, 1, 1\n", ("line 3: names no source",)),
    ("source, true_m, measured_m\nleft, 1, \n", ("none of 1 distances has a reading",)),
])  # fmt: skip
def test_wrong_tables_are_one_line(refused, tmp_path, text, words):
    file = tmp_path / "t.csv"
    file.write_text(text)
    refused(["calibrate", "offsets", file], 1, "t.csv", *words)


def test_offsets_of_a_table_are_applied_whatever_sources_are_called(run, bench, tmp_path):
    file, setup = tmp_path / "t.csv", tmp_path / "s.toml"
    file.write_text("source,true_m,measured_m\nleft,0.5,0.53\nleft,0.7,\nleft,0.9,0.93\n")
    setup.write_text('[calibration.source_offset."source/left"]\noffset = 9.0\n')
    outcome = run("calibrate", "offsets", file, "-o", setup)
    assert outcome.code == 0 and not outcome.err
    figures = read_setup_figures(setup)
    assert list(figures.calibration.source_offset) == ["source/left"]
    for name in ("source/left", "left"):
        setup.write_text(f'[calibration.source_offset."{name}"]\noffset = 0.03\n')
        recording = read_recording(bench["near"])
        figures = read_setup_figures(setup).calibration
        corrected = with_calibration(recording, figures).ranges
        of = np.array(corrected.source_names)[np.asarray(corrected.source)]
        change = np.asarray(recording.ranges.distance) - np.asarray(corrected.distance)
        np.testing.assert_allclose(change, np.where(of == "source/left", 0.03, 0.0), atol=1e-12)


def test_tables_with_recordings_name_what_is_missing(refused, run, bench, tmp_path):
    file = tmp_path / "t.csv"
    for line, words in (
        ("left, board9, 0.5, , ", ("line 2", "unknown receiver 'board9'", "board0")),
        ("left, board0, 0.5, far.mcap, ", ("line 2", "unknown recording 'far.mcap'", "near.mcap")),
        ("left, board0, 0.5, , 900", ("line 2", "no reading of source 'left'", "900")),
    ):
        file.write_text(f"source, receiver, true_m, recording, start_s\n{line}\n")
        refused(["calibrate", "offsets", file, bench["near"]], 1, "t.csv", *words)
    refused(["calibrate", "offsets", file, bench["still"]], 1, "t.csv: line 2", "no distances")
    file.write_text("source,true_m,measured_m\nbeeper,0.5,0.51\nbeeper,0.5,0.52\nbeeper,0.9,0.93\n")
    outcome = run("calibrate", "offsets", file, "-o", tmp_path / "s.toml")
    assert outcome.code == 0
    offset = read_setup_figures(tmp_path / "s.toml").calibration.source_offset["beeper"]
    assert offset.offset == pytest.approx(0.0225)
