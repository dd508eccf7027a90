"""A wrong file gives one line that names it, the right exit code, and leaves nothing behind."""

from __future__ import annotations

import dataclasses
import os
import re

import numpy as np
import pytest

from mocap_jax.io import write_recording

FAILURE, USAGE = 1, 2


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


def test_given_root_that_is_missing_throughout(refused, recording, tmp_path):
    path = tmp_path / "rootless.mcap"
    n = len(recording.root.time)
    root = dataclasses.replace(
        recording.root, position=np.full((n, 3), np.nan), orientation=np.full((n, 4), np.nan)
    )
    write_recording(path, dataclasses.replace(recording, root=root))
    refused(["reconstruct", path, "--root", "given"], USAGE, "rootless.mcap", "/root")


def test_clock_that_jumps_by_a_day(refused, recording, tmp_path):
    path = tmp_path / "jump.mcap"
    late = lambda s: dataclasses.replace(s, time=s.time + 86400.0 * (s.time > 1.5))  # noqa: E731
    boards = {name: late(board) for name, board in recording.inertial.items()}
    jumped = dataclasses.replace(recording, inertial=boards, root=late(recording.root))
    write_recording(path, jumped)
    refused(["reconstruct", path, "--method", "ekf"], FAILURE, "jump.mcap", "86400 s", "cut")


def test_known_distances_in_millimetres(refused, tmp_path):
    table = tmp_path / "known.csv"
    table.write_text("source,true_m,measured_m\na,300,310\n")
    refused(["calibrate", "offsets", table], FAILURE, "known.csv: line 2", "millimetres")


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
        (" \n", "the file is empty"),
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


@pytest.mark.parametrize("text", ["", "# nothing yet\n"])
def test_set_up_file_without_entries(refused, recording_file, tmp_path, text):
    (tmp_path / "setup.toml").write_text(text)
    arguments = ["reconstruct", recording_file, "--setup", tmp_path / "setup.toml"]
    refused(arguments, FAILURE, "setup.toml", "empty", "[noise]", "[calibration]")


# Motions and suits


@pytest.mark.parametrize("objects", [False, True])
def test_archive_that_is_none_is_not_to_be_trusted(run, tmp_path, objects):
    path = tmp_path / "walk.npz"
    if objects:
        np.savez(path, time=np.array([{}]), q=np.zeros((1, 7)), body_xml="")
    else:
        path.write_bytes(b"no archive at all")
    outcome = run("info", path)
    assert outcome.code == FAILURE and len(outcome.error_lines) == 1, outcome
    assert "walk.npz" in outcome.err and "pickle" not in outcome.err, outcome.err
    assert ("Python objects" if objects else "not a readable NPZ file") in outcome.err


def test_motion_that_is_neither_file_nor_builtin(refused, tmp_path):
    arguments = ["simulate", "dancing", "-o", tmp_path / "a.mcap"]
    refused(arguments, FAILURE, "dancing", "walking", "routine")


@pytest.mark.parametrize("motion", ["walking:0-3s", "walking:0"])
def test_stretch_that_is_none(refused, tmp_path, motion):
    arguments = ["simulate", motion, "-o", tmp_path / "a.mcap"]
    refused(arguments, FAILURE, motion, "walking:2-7")


def test_folder_instead_of_a_motion(refused, tmp_path):
    refused(["simulate", tmp_path, "-o", tmp_path / "a.mcap"], FAILURE, "this is a folder")


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
