"""Which body performs a motion: what the arguments make of it."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

from mocap_jax.body import frames
from mocap_jax.cli.body_choice import add_body_arguments, chosen_body
from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion, builtin_motion, human, load_skeleton, segment_lengths


def parsed(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_body_arguments(parser)
    return parser.parse_args(arguments)


@pytest.fixture(scope="module")
def walk() -> Motion:
    return builtin_motion("walking")


def test_nothing_asked_is_the_motion_s_own(walk: Motion) -> None:
    assert chosen_body(parsed()) is None
    assert chosen_body(parsed(), walk) is None


def test_human_as_asked(walk: Motion) -> None:
    options = ["--height", "1.65", "--sex", "female", "--length", "UpperArm=0.3",
               "--length", "LeftHand=0.15"]  # fmt: skip
    wanted = human(1.65, 70.0 * (1.65 / 1.75) ** 2, "female", {"UpperArm": 0.3, "LeftHand": 0.15})
    assert chosen_body(parsed("--body", "human", *options), walk).xml == wanted.xml
    assert chosen_body(parsed(*options)).xml == wanted.xml  # of a built-in motion
    assert chosen_body(parsed("--body", "human"), walk).xml == human().xml


def test_sex_in_any_case() -> None:
    wanted = human(1.75, 70.0, "female").xml
    assert chosen_body(parsed("--sex", "Female")).xml == wanted
    assert chosen_body(parsed("--sex", "FEMALE")).xml == wanted


def test_human_like_the_clip(walk: Motion) -> None:
    body = chosen_body(parsed("--body", "human-like-clip", "--mass", "80"), walk)
    assert segment_lengths(body) == pytest.approx(segment_lengths(walk.body), rel=1e-6)
    assert body.mujoco_model().body_mass.sum() == pytest.approx(80.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--height", "1.8"], "--height is for --body human"),
        (["--body", "a.xml", "--sex", "male"], "--sex is for --body human"),
        (["--body", "human", "--length", "UpperArm"], "expected SEGMENT=METRES"),
        (["--body", "human", "--length", "UpperArm=long"], "expected SEGMENT=METRES"),
        (["--body", "human-like-clip", "--height", "1.8"], "--height does not go with"),
    ],
)
def test_options_that_make_no_sense(walk: Motion, arguments: list[str], words: str) -> None:
    with pytest.raises(UsageError, match=words):
        chosen_body(parsed(*arguments), walk)


def skeleton_file(folder: Path) -> Path:
    """The built-in human's joints as a table."""
    body = human()
    place, topology = frames(body, body.qpos0).position, body.topology
    names = ("", *topology.body_names[1:])
    rows = [
        f"{names[b]},{names[topology.body_parent[b]]},{','.join(map(str, place[b].tolist()))}"
        for b in range(1, topology.nbody)
    ]
    file = folder / "joints.csv"
    file.write_text("\n".join(["joint,parent,x,y,z", *rows]))
    return file


def test_a_skeleton_of_joint_positions(walk: Motion, tmp_path: Path) -> None:
    file = skeleton_file(tmp_path)
    body = chosen_body(parsed("--body", str(file)), walk)
    assert body is not None and body.xml == load_skeleton(file).xml and body.has_free_root
    with pytest.raises(InputError, match=r"none.json: no such file"):
        chosen_body(parsed("--body", "none.json"), walk)


def skeleton_files(folder: Path) -> list[Path]:
    """The same skeleton in every kind of file that holds one."""
    body = human()
    place, topology = np.asarray(frames(body, body.qpos0).position)[1:], body.topology
    joints = {
        "joints": list(topology.body_names[1:]), "positions": place.tolist(),
        "parents": [p - 1 for p in topology.body_parent[1:]],
    }  # fmt: skip
    (folder / "joints.json").write_text(json.dumps(joints))
    np.savez(folder / "joints.npz", **{k: np.array(v) for k, v in joints.items()})
    return [skeleton_file(folder), folder / "joints.json", folder / "joints.npz"]


def test_info_tells_skeletons_and_motions_apart(run, walk: Motion, tmp_path: Path) -> None:
    for file in skeleton_files(tmp_path):
        outcome = run("info", file)
        assert outcome.code == 0, outcome.err
        assert "kind: body (skeleton of joint positions)" in outcome.out
        assert "body: 23 segments (root Pelvis), 23 joints (1 free, 22 ball)" in outcome.out
    path = walk.trajectory
    np.savez(tmp_path / "walk.npz", time=path.time, q=path.q, body_xml=walk.body.xml)
    assert "kind: motion" in run("info", tmp_path / "walk.npz").out
    (tmp_path / "bad.npz").write_text("no archive")
    outcome = run("info", tmp_path / "bad.npz")
    assert outcome.code == 1 and "not a readable NPZ file" in outcome.err
    (tmp_path / "bad.doc").write_text("")
    assert "valid: .mcap, .amc, .bvh, .npz, .xml, .osim, .asf, .json, .csv, .toml" in (
        run("info", tmp_path / "bad.doc").err
    )


def test_boards_of_other_bodies_on_a_skeleton(recording_file, refused, tmp_path: Path) -> None:
    """The recording's body has no legs, so that nothing tells how its pose looks on a skeleton."""
    file = skeleton_file(tmp_path)
    refused(["reconstruct", recording_file, "--body", file], 1, str(recording_file), "LeftUpperLeg")


def test_wrong_values(walk: Motion) -> None:
    with pytest.raises(UsageError, match="for motion files"):
        chosen_body(parsed("--body", "human-like-clip"))
    with pytest.raises(UsageError, match="--sex: unknown sex 'boy'; valid: female, male"):
        chosen_body(parsed("--body", "human", "--sex", "boy"), walk)
    with pytest.raises(UsageError, match="--length: unknown segment 'Arm'"):
        chosen_body(parsed("--body", "human", "--length", "Arm=0.3"), walk)
    with pytest.raises(InputError, match=r"nowhere.xml: no such MJCF file"):
        chosen_body(parsed("--body", "nowhere.xml"), walk)
