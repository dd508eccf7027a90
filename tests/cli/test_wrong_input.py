"""Wrong input gives one line that names it, the right exit code, and leaves nothing behind."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path

import numpy as np
import pytest

from mocap_jax.io import write_recording

FAILURE, USAGE = 1, 2


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


# Arguments


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
        ["simulate", "routine", "-o", "{out}.mcap", "--json", "{out}.mcap"],
    ],
)
def test_inputs_are_not_written_over(refused, recording_file, tmp_path, arguments):
    before = Path(recording_file).read_bytes()
    named = [a.format(rec=recording_file, out=tmp_path / "out") for a in arguments]
    code_words = (USAGE, "overwrite") if "simulate" not in arguments else (USAGE,)
    refused(named, *code_words)
    assert Path(recording_file).read_bytes() == before


def test_the_rest_hold_alone_is_reconstructed_without_errors(run, recording, tmp_path):
    later = dataclasses.replace(recording.setup, score_from=1e3)
    write_recording(tmp_path / "cut.mcap", dataclasses.replace(recording, setup=later))
    outcome = run("reconstruct", tmp_path / "cut.mcap", "--method", "ekf")
    assert outcome.code == 0, outcome
    assert "no errors" in outcome.out
    assert (tmp_path / "cut.solution.mcap").is_file()


def test_unknown_sensor_kind(refused, recording_file):
    refused(["reconstruct", recording_file, "--sensors", "A,Q"], USAGE, "'Q'", "gyroscope")


def test_magnetometer_is_refused_by_name(refused, recording_file):
    refused(["reconstruct", recording_file, "--sensors", "A,G,M"], USAGE, "magnetometer")


@pytest.mark.parametrize("method", ["ukf", "optimize"])
def test_unknown_method(refused, recording_file, method):
    refused(
        ["reconstruct", recording_file, "--method", method],
        USAGE,
        "--method",
        method,
        "optimise",
        "ekf",
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


# Files


@pytest.mark.parametrize("verb", ["info", "reconstruct"])
def test_missing_recording(refused, tmp_path, verb):
    refused([verb, tmp_path / "nowhere.mcap"], FAILURE, "nowhere.mcap")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 surely a zip file", b"<mujoco/>" * 50])
@pytest.mark.parametrize("verb", ["info", "reconstruct"])
def test_file_that_is_not_mcap(refused, tmp_path, verb, content):
    path = tmp_path / "other.mcap"
    path.write_bytes(content)
    refused([verb, path], FAILURE, "other.mcap")


def test_folder_instead_of_a_file(refused, tmp_path):
    refused(["reconstruct", tmp_path, "-o", tmp_path / "a.mcap"], FAILURE, str(tmp_path))
    refused(["info", tmp_path], FAILURE, "this is a folder")
    refused(["reconstruct", "/"], FAILURE, "this is a folder")
    refused(["reconstruct", ""], FAILURE, "this is a folder")


@pytest.mark.parametrize("name", ["motion.bvh", "07_01.AMC", "walk.npz"])
@pytest.mark.parametrize("verb", ["reconstruct", "export", "evaluate"])
def test_motion_where_a_recording_is_wanted(refused, tmp_path, verb, name):
    motion = tmp_path / name
    motion.write_text("HIERARCHY\n")
    after = {"export": ["-o", tmp_path / "a.csv"], "evaluate": ["b.mcap"]}.get(verb, [])
    hint = f"mocap-jax simulate {motion} -o {motion.stem}.mcap"
    refused([verb, motion, *after], FAILURE, "this is a motion file", hint)


def test_motion_that_is_not_there(refused, tmp_path):
    refused(["reconstruct", tmp_path / "none.bvh"], FAILURE, "none.bvh: no such file")


def test_output_folder_that_does_not_exist(refused, recording_file, tmp_path):
    output = tmp_path / "no" / "such" / "a.mcap"
    refused(["reconstruct", recording_file, "-o", output], FAILURE, "no/such")


def test_output_below_a_file(refused, recording_file):
    refused(["demo", "-o", recording_file / "below"], FAILURE, "still.mcap")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_output_folder_without_permission(refused, recording_file, tmp_path):
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    refused(["reconstruct", recording_file, "-o", folder / "a.mcap"], FAILURE, "locked")


def test_recording_where_a_solution_is_wanted(refused, recording_file, tmp_path):
    arguments = ["export", recording_file, "-o", tmp_path / "a.bvh"]
    refused(arguments, FAILURE, "still.mcap", "solution")


def test_recording_without_any_stream(refused, recording, tmp_path):
    empty = dataclasses.replace(recording, inertial={}, root=None, truth=None)
    path = tmp_path / "empty.mcap"
    write_recording(path, empty)
    refused(["reconstruct", path], FAILURE, "empty.mcap")


def test_time_that_runs_backwards(refused, recording, tmp_path):
    board = recording.inertial["chest"]
    time = np.array(board.time)
    time[60] = time[40]
    inertial = {**recording.inertial, "chest": dataclasses.replace(board, time=time)}
    path = tmp_path / "backwards.mcap"
    write_recording(path, dataclasses.replace(recording, inertial=inertial))
    refused(["reconstruct", path], FAILURE, "backwards.mcap", "chest")


def test_readings_that_are_all_missing(refused, recording, tmp_path):
    nothing = {
        name: dataclasses.replace(
            board,
            accelerometer=np.full_like(board.accelerometer, np.nan),
            gyroscope=np.full_like(board.gyroscope, np.nan),
        )
        for name, board in recording.inertial.items()
    }
    path = tmp_path / "nothing.mcap"
    write_recording(path, dataclasses.replace(recording, inertial=nothing))
    refused(["reconstruct", path], FAILURE)


def test_given_root_that_is_not_there(refused, recording, tmp_path):
    path = tmp_path / "rootless.mcap"
    write_recording(path, dataclasses.replace(recording, root=None))
    refused(["reconstruct", path, "--root", "given"], USAGE, "rootless.mcap", "/root")


# Bodies


def test_sensor_without_a_site(refused, recording, tmp_path):
    body = tmp_path / "other.xml"
    body.write_text(recording.body_xml.replace('site name="chest"', 'site name="breast"'))
    path = tmp_path / "still.mcap"
    write_recording(path, recording)
    refused(["reconstruct", path, "--body", body], FAILURE, "chest", "breast")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("<mujoco><worldbody>", "XML"),
        ("<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>", "joint"),
        ("<mujoco><worldbody/></mujoco>", "body"),
        ("<urdf/>", "body.xml"),
        ("no XML at all", "body.xml"),
    ],
)
def test_body_that_is_none(refused, recording_file, tmp_path, text, word):
    body = tmp_path / "body.xml"
    body.write_text(text)
    refused(["reconstruct", recording_file, "--body", body], FAILURE, "body.xml", word)


def test_body_without_sites_is_to_blame(refused, recording_file, recording, tmp_path):
    body = tmp_path / "bare.xml"
    body.write_text(re.sub("<site[^>]*/>", "", recording.body_xml))
    arguments = ["reconstruct", recording_file, "--body", body]
    refused(arguments, FAILURE, "bare.xml: the body has no sites", "'pelvis'")


def test_missing_body(refused, recording_file, tmp_path):
    arguments = ["reconstruct", recording_file, "--body", tmp_path / "none.xml"]
    refused(arguments, FAILURE, "none.xml")


# Motions and suits


def test_motion_that_is_neither_file_nor_builtin(refused, tmp_path):
    arguments = ["simulate", "dancing", "-o", tmp_path / "a.mcap"]
    refused(arguments, FAILURE, "dancing", "walking", "routine")


def test_motion_of_unknown_format(refused, tmp_path):
    motion = tmp_path / "a.fbx"
    motion.write_text("")
    refused(["simulate", motion, "-o", tmp_path / "a.mcap"], FAILURE, "a.fbx", ".bvh")


def test_clip_without_its_skeleton(refused, tmp_path):
    clip = tmp_path / "07_01.amc"
    clip.write_text(":FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\n")
    refused(["simulate", clip, "-o", tmp_path / "a.mcap"], FAILURE, "07_01.amc", "07.asf")


def test_broken_motion(refused, tmp_path):
    motion = tmp_path / "a.bvh"
    motion.write_text("HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0\n")
    refused(["simulate", motion, "-o", tmp_path / "a.mcap"], FAILURE, "a.bvh")


@pytest.mark.parametrize(
    ("text", "word"),
    [("boards = [", "TOML"), ("sensor = 3\n", "boards"), ("\x00", "suit.toml")],
)
def test_suit_that_is_none(refused, tmp_path, text, word):
    suit = tmp_path / "suit.toml"
    suit.write_text(text)
    arguments = ["simulate", "walking", "--sensors", suit, "-o", tmp_path / "a.mcap"]
    refused(arguments, FAILURE, "suit.toml", word)
