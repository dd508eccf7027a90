"""Wrong usage gives one line that names the option and the valid choices, and exit code 2."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import pytest

from mocap_jax.io import write_recording

FAILURE, USAGE = 1, 2


def test_no_verb(refused):
    refused([], USAGE, "VERB")


def test_unknown_verb(refused):
    refused(["reconstuct", "a.mcap"], USAGE, "reconstuct", "reconstruct")


def test_unknown_option(refused):
    refused(["info", "--colour", "a.mcap"], USAGE, "--colour")


@pytest.mark.parametrize(
    "arguments",
    [
        ["reconstruct", "{rec}", "-o", "{rec}", "--method", "ekf"],
        ["reconstruct", "{rec}", "--json", "{rec}", "--method", "ekf"],
        ["evaluate", "{rec}", "{rec}", "--json", "{rec}"],
        ["reconstruct", "{rec}", "-o", "{out}.mcap", "--json", "{out}.mcap"],
    ],
)
def test_inputs_are_not_written_over(refused, recording_file, tmp_path, arguments):
    before = Path(recording_file).read_bytes()
    named = [a.format(rec=recording_file, out=tmp_path / "out") for a in arguments]
    writes = "what --output writes" if "{out}.mcap" in arguments else "a file that this call reads"
    refused(named, USAGE, f"would overwrite {writes}")
    assert Path(recording_file).read_bytes() == before


def test_the_rest_hold_alone_is_reconstructed_without_errors(run, recording, tmp_path):
    later = dataclasses.replace(recording.setup, score_from=1e3)
    write_recording(tmp_path / "cut.mcap", dataclasses.replace(recording, setup=later))
    outcome = run("reconstruct", tmp_path / "cut.mcap", "--method", "ekf")
    assert outcome.code == 0, outcome
    assert "no errors" in outcome.out
    assert (tmp_path / "cut.solution.mcap").is_file()


def test_default_output_is_not_written_over_the_start(refused, recording_file, tmp_path):
    start = tmp_path / "still.solution.mcap"
    start.write_bytes(b"kept")
    refused(["reconstruct", recording_file, "--initial", start], USAGE, "overwrite", "--initial")
    assert start.read_bytes() == b"kept"


def test_pipe_is_not_replaced_by_a_file(refused, recording_file, tmp_path):
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    refused(["reconstruct", recording_file, "--json", pipe], FAILURE, "pipe.json", "regular file")
    assert pipe.is_fifo()


def test_misspelt_height_of_the_human_names_body(refused, recording_file):
    arguments = ["reconstruct", recording_file, "--body", "human:heigth=1.8"]
    refused(arguments, USAGE, "--body human:heigth=1.8", "'heigth'", "height", "UpperLeg")


@pytest.mark.parametrize("verb", ["reconstruct", "batch", "simulate", "calibrate mounting"])
def test_name_of_a_body_that_is_none(refused, recording_file, tmp_path, verb):
    source = "walking" if verb == "simulate" else recording_file
    arguments = [*verb.split(), source, "-o", tmp_path / "out.mcap", "--body", "robot"]
    refused(arguments, USAGE, "--body robot", ".xml", ".osim", "human:height=1.80")


@pytest.mark.parametrize("option", ["--body", "--setup"])
def test_batch_with_a_missing_file_makes_no_folder(refused, recording_file, tmp_path, option):
    arguments = ["batch", recording_file, "-o", tmp_path / "results", option, tmp_path / "none.xml"]
    refused(arguments, FAILURE, "none.xml")


def test_batch_of_missing_recordings_makes_no_folder(refused, tmp_path):
    refused(["batch", tmp_path / "none.mcap", "-o", tmp_path / "results"], FAILURE, "none.mcap")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["walkin"], FAILURE, ("walkin", "walking")),
        (["walking", "--objective", "B"], USAGE, ("--objective", "'B'", "worst")),
        (["walking", "--sensors", "AM"], USAGE, ("--sensors", "'AM'", "AG")),
        (["walking", "--over", "most"], USAGE, ("--over", "'most'", "worst")),
        (["walking", "--root", "fixed"], USAGE, ("--root", "'fixed'", "free")),
        (["walking", "-n", "0"], USAGE, ("--number", "1 or more")),
        (["walking", "-n", "40"], USAGE, ("--number 40", "more than", "Pelvis")),
        (["walking", "-n", "6", "--most", "3"], USAGE, ("--most 3", "6 (--number)")),
        (["walking", "--restarts", "0"], USAGE, ("--restarts", "1 or more")),
        (["walking", "--allow", "Hed"], USAGE, ("--allow", "'Hed'", "Head")),
        (["walking", "--require", "Hed"], USAGE, ("--require", "'Hed'", "Head")),
        (["walking", "--allow", "Head", "--require", "T8"], USAGE, ("--require", "'T8'", "Head")),
        (["walking", "--cost", "Hed=2"], USAGE, ("--cost", "'Hed'", "Head")),
        (["walking", "--cost", "Head=-1"], USAGE, ("--cost Head=-1", "zero or more")),
        (["walking", "--cost", "Head=nan"], USAGE, ("--cost Head=nan", "zero or more")),
        (["walking", "--cost", "Head"], USAGE, ("--cost Head", "SEGMENT=COST")),
    ],
)
def test_refused_placement_makes_no_folder(refused, tmp_path, arguments, code, words):
    refused(["place", *arguments, "-o", tmp_path / "placement"], code, *words)


@pytest.mark.parametrize(("pose", "word"), [("Knee = [0.1]", "Knee"), ("T8 = [0.1]", "ball")])
def test_wrong_pose_names_its_file(refused, recording_file, tmp_path, pose, word):
    (tmp_path / "pose.toml").write_text(pose)
    arguments = ["calibrate", "mounting", recording_file, "-o", tmp_path / "worn.mcap"]
    refused([*arguments, "--pose", tmp_path / "pose.toml"], FAILURE, "pose.toml: ", word)


def test_unknown_sensor_kind(refused, recording_file):
    refused(["reconstruct", recording_file, "--sensors", "A,Q"], USAGE, "'Q'", "gyroscope")


@pytest.mark.parametrize(
    ("option", "method"), [("--contacts", "ekf"), ("--gravity", "orientation")]
)
def test_contacts_and_gravity_belong_to_some_methods(refused, recording_file, option, method):
    arguments = ["reconstruct", recording_file, option, "--method", method]
    refused(arguments, USAGE, option, "optimise")


def test_magnetometers_need_magnetic_streams(refused, recording_file):
    refused(
        ["reconstruct", recording_file, "--sensors", "A,G,M"], FAILURE, "kind M", "/magnetic/",
        "valid kinds",
    )  # fmt: skip


@pytest.mark.parametrize("method", ["unscented", "optimize"])
def test_unknown_method(refused, recording_file, method):
    refused(
        ["reconstruct", recording_file, "--method", method],
        USAGE,
        "--method",
        method,
        "optimise",
        "ekf",
        "ukf",
    )


def test_unknown_preset(refused, recording_file):
    refused(["reconstruct", recording_file, "--preset", "best"], USAGE, "--preset", "best", "paper")


def test_unknown_profile(refused, tmp_path):
    arguments = ["simulate", "walking", "-o", tmp_path / "a.mcap", "--profile", "real"]
    refused(arguments, USAGE, "--profile", "real", "ideal", "paper", "field")


@pytest.mark.parametrize(
    ("option", "value", "valid"),
    [
        ("--seed", "-1", "zero or more"),
        ("--seed", "1.5", "zero or more"),
        ("--skip", "-1", "zero or more"),
        ("--sex", "boy", "female, male"),
        ("--height", "30", "0.5 to 2.5 m"),
        ("--height", "-1", "above zero"),
        ("--mass", "1", "5 to 300 kg"),
        ("--length", "Arm=0.3", "UpperArm"),
        ("--length", "UpperArm=30", "0.112 to 0.701 m"),
        ("--length", "UpperArm", "SEGMENT=METRES"),
        ("--fps", "1e9", "1 to 10000"),
        ("--scale", "1e9", "0.0001 to 10"),
        ("--cutoff", "1e-9", "0.1 to 1000"),
    ],
)
def test_wrong_value_of_an_option_of_simulate(refused, tmp_path, option, value, valid):
    arguments = ["simulate", "walking", "-o", tmp_path / "a.mcap", option, value]
    refused(arguments, USAGE, option, value.partition("=")[0], valid)


@pytest.mark.parametrize("value", ["robot", "GIVEN"])
def test_unknown_root(refused, recording_file, value):
    refused(["reconstruct", recording_file, "--root", value], USAGE, "--root", value, "'free'")


@pytest.mark.parametrize(
    ("verb", "suffixes"), [("report", (".html",)), ("reconstruct", (".mcap",))]
)
def test_unknown_suffix_of_an_output(refused, tmp_path, verb, suffixes):
    refused([verb, "a.mcap", "-o", tmp_path / "a.pdf"], USAGE, "--output", ".pdf", *suffixes)


BVH = (
    """HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 30 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 30 0
    }
  }
}
MOTION
Frames: 12
Frame Time: 0.01
"""
    + "0 90 0 1 2 3 4 5 6\n" * 12
)


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--skip", "12", ("no frames are left",)),
        ("--skeleton", "a.asf", (".amc",)),
        ("--mass", "1", ("5 to 300 kg",)),
    ],
)
def test_option_that_does_not_fit_the_clip(refused, tmp_path, option, value, words):
    clip = tmp_path / "a.bvh"
    clip.write_text(BVH)
    arguments = ["simulate", clip, "-o", tmp_path / "b.mcap", option, value]
    if option == "--mass":
        arguments += ["--body", "human-like-clip"]
    refused(arguments, USAGE, option, *words)


def test_fault_of_the_clip_itself_is_none_of_skip(refused, tmp_path):
    clip = tmp_path / "a.bvh"
    clip.write_text(BVH.replace("Frames: 12", "Frames: none"))
    refused(["simulate", clip, "-o", tmp_path / "b.mcap", "--skip", "2"], FAILURE, "a.bvh")


def test_scale_of_an_npz(refused, tmp_path):
    arguments = ["simulate", "a.npz", "-o", tmp_path / "b.mcap", "--scale", "0.01"]
    refused(arguments, USAGE, "--scale", ".amc and .bvh")


@pytest.mark.parametrize("value", ["-3", "fast", "0", "inf"])
def test_frame_rate_that_is_none(refused, tmp_path, value):
    arguments = ["simulate", "a.bvh", "-o", tmp_path / "a.mcap", f"--fps={value}"]
    refused(arguments, USAGE, "--fps", value)


def test_unknown_suffix_of_an_export(refused, tmp_path):
    arguments = ["export", "a.solution.mcap", "-o", tmp_path / "a.fbx"]
    refused(arguments, USAGE, "--output", ".fbx", ".bvh", ".csv", ".npz")


def test_file_option_for_a_builtin_motion(refused, tmp_path):
    arguments = ["simulate", "walking", "--fps", "60", "-o", tmp_path / "a.mcap"]
    refused(arguments, USAGE, "--fps", "walking")


def test_orientations_that_were_not_measured(refused, recording_file):
    arguments = ["reconstruct", recording_file, "--method", "orientation"]
    refused(arguments, USAGE, "no measured orientations", "ekf")
    refused([*arguments, "--sensors", "A,O"], USAGE, "--sensors")
