"""`mocap-jax convert` on the command line: outputs, exit codes, one line for wrong input."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "io" / "convert"))
from known_motion import known
from xsens_files import write

from mocap_jax.body import frames, load_body
from mocap_jax.io import read_recording
from mocap_jax.motion import human

SALVAGED = 3


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "data").mkdir()
    write(tmp_path / "data", known(600, seed=1), "00B4AAAA")
    write(tmp_path / "data", known(600, seed=2), "00B4BBBB")
    (tmp_path / "map.csv").write_text("id,segment\n00B4AAAA,Pelvis\n00B4BBBB,T8\n")
    return tmp_path


def test_a_folder_becomes_a_recording(run, folder):
    outcome = run("convert", folder / "data", "--mapping", folder / "map.csv", "-o",
                  folder / "a.mcap")  # fmt: skip
    assert outcome.code == 0 and not outcome.err
    assert "Pelvis: 100 Hz, from 00B4AAAA, on Pelvis" in outcome.out
    info = run("info", folder / "a.mcap")
    assert info.code == 0
    for words in ("source_format = xsens-mt", "heading = ", "clock = packet counter",
                  "T8: from 00B4BBBB, on T8", "sensor check: nothing suspicious"):  # fmt: skip
        assert words in info.out


@pytest.mark.parametrize("suffix", ["json", "csv", "npz"])
def test_a_skeleton_of_joint_positions_wears_the_sensors(run, folder, suffix):
    body = human()
    place, topology = np.asarray(frames(body, body.qpos0).position)[1:], body.topology
    names, parents = topology.body_names[1:], [p - 1 for p in topology.body_parent[1:]]
    file = folder / f"joints.{suffix}"
    if suffix == "json":
        joints = {"joints": names, "positions": place.tolist(), "parents": parents}
        file.write_text(json.dumps(joints))
    elif suffix == "npz":
        np.savez(file, joints=np.array(names), positions=place, parents=np.array(parents))
    else:
        rows = [f"{n},{('', *names)[p + 1]},{x},{y},{z}"
                for n, p, (x, y, z) in zip(names, parents, place, strict=True)]  # fmt: skip
        file.write_text("\n".join(["joint,parent,x,y,z", *rows]))
    outcome = run("convert", folder / "data", "--mapping", folder / "map.csv", "--body", file,
                  "-o", folder / "a.mcap")  # fmt: skip
    assert outcome.code == 0, outcome.err
    worn = load_body(read_recording(folder / "a.mcap").body_xml).topology
    assert worn.site_names == ("Pelvis", "T8") and worn.body_names == body.topology.body_names
    assert [worn.body_names[b] for b in worn.site_body] == ["Pelvis", "T8"]


def test_findings_are_warnings_unless_strict(run, refused, folder):
    arguments = ["convert", folder / "data", "--accelerometer-unit", "g", "-o", folder / "a.mcap"]
    outcome = run(*arguments)
    assert outcome.code == 0 and (folder / "a.mcap").is_file()
    assert "9.8 times too large" in outcome.err
    assert outcome.err.endswith(" Option: --accelerometer-unit m/s^2.\n")
    (folder / "a.mcap").unlink()
    refused([*arguments, "--strict"], 1, "9.8 times too large")


def test_salvaged_input_is_said_and_coded(run, folder):
    file = sorted((folder / "data").iterdir())[0]
    file.write_text(file.read_text().rstrip("\n").rsplit("\t", 3)[0])
    outcome = run("convert", folder / "data", "-o", folder / "a.mcap")
    assert outcome.code == SALVAGED and "truncated" in outcome.err
    assert (folder / "a.mcap").is_file()


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (["nowhere", "-o", "a.mcap"], 1, ["nowhere: no such file or folder"]),
        (["data", "-o", "a.txt"], 2, ["unknown suffix '.txt'; valid: .mcap"]),
        (["data", "-o", "none/a.mcap"], 1, ["not an existing folder"]),
        (["data", "-o", "a.mcap", "--format", "xsens"], 2, ["--format", "valid: xsens-mt"]),
        (["data", "-o", "a.mcap", "--gyroscope-unit", "dps"], 2, ["valid: rad/s, deg/s"]),
        (["data", "-o", "a.mcap", "--gravity-sign", "2"], 2, ["valid: 1, -1"]),
        (["data", "-o", "a.mcap", "--height", "1.8"], 2, ["--height is for --body human"]),
        (["data", "-o", "a.mcap", "--mapping", "m.csv"], 1, ["m.csv: no such mapping file"]),
        (["data", "-o", "a.mcap", "--format", "mvnx"], 1, ["no MVNX file there"]),
        (["data", "-o", "a.mcap", "--body", "none.xml"], 1, ["none.xml"]),
        (["data", "-o", "a.mcap", "--body", "mvn"], 1, ["no body can be made of it"]),
        (["map.csv", "-o", "a.mcap"], 1, ["needs a mapping"]),
        (["data", "-o", "map.mcap", "--mapping", "map.mcap"], 2, ["would overwrite"]),
    ],
)
def test_wrong_input_gets_one_line(refused, folder, monkeypatch, arguments, code, words):
    monkeypatch.chdir(folder)
    refused(["convert", *arguments], code, *words)
