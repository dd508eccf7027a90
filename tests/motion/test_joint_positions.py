"""Skeletons from files of joint positions, made here from the built-in human's joints."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.motion.joint_names import SMPL_JOINTS, SMPL_PARENTS

# From SMPL's joints to the human's segments.
SEGMENT = dict(
    zip(
        SMPL_JOINTS,
        ("Pelvis", "LeftUpperLeg", "RightUpperLeg", "L5", "LeftLowerLeg", "RightLowerLeg", "T12",
         "LeftFoot", "RightFoot", "T8", "LeftToe", "RightToe", "Neck", "LeftShoulder",
         "RightShoulder", "Head", "LeftUpperArm", "RightUpperArm", "LeftForeArm", "RightForeArm",
         "LeftHand", "RightHand", "LeftFingers", "RightFingers"),
        strict=True,
    )
)  # fmt: skip
# X left, Y up, Z forward, as statistical models have it, from X forward, Y left, Z up.
TO_FILE = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])


def positions(body: mj.Body, q: np.ndarray) -> dict[str, np.ndarray]:
    """Joint positions in a pose, by C MuJoCo."""
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    data.qpos = q
    mujoco.mj_kinematics(model, data)
    return {model.body(i).name: data.xpos[i].copy() for i in range(1, model.nbody)}


def t_pose(body: mj.Body) -> np.ndarray:
    """The human with its arms spread."""
    q = np.array(body.qpos0)
    topology = body.topology
    for side, sign in (("Left", 1), ("Right", -1)):
        at = topology.joint_qpos[topology.joint_index(f"{side}UpperArm")]
        turn = Rotation.from_rotvec([sign * np.pi / 2, 0, 0])
        q[at : at + 4] = turn.as_quat(scalar_first=True)
    return q


@pytest.fixture(scope="module")
def table() -> tuple[mj.Body, np.ndarray, np.ndarray]:
    """The human, and SMPL's 24 joints of it in T-pose, in our axes and in the file's."""
    body = mj.human()
    place = positions(body, t_pose(body))
    for side in ("Left", "Right"):
        hand = place[f"{side}Hand"]
        place[f"{side}Fingers"] = hand + 0.4 * (hand - place[f"{side}ForeArm"])
    ours = np.array([place[SEGMENT[joint]] for joint in SMPL_JOINTS])
    return body, ours, ours @ TO_FILE.T


def written(path: Path, places: np.ndarray, **entries: object) -> Path:
    document = {"joints": SMPL_JOINTS, "parents": SMPL_PARENTS, "positions": places.tolist()}
    document |= entries
    path.write_text(json.dumps({k: v for k, v in document.items() if v is not None}))
    return path


def test_the_rest_pose_is_the_file_s(table, tmp_path):
    _, ours, theirs = table
    body = mj.load_skeleton(written(tmp_path / "own.json", theirs))
    assert body.has_free_root
    assert body.topology.joint_types == ("free", *["ball"] * 23)
    assert set(body.topology.body_names[1:]) == set(SEGMENT.values())
    place = positions(body, np.asarray(body.qpos0))
    found = np.array([place[SEGMENT[joint]] for joint in SMPL_JOINTS])
    np.testing.assert_allclose(found - found[0], ours - ours[0], atol=1e-9)
    # It stands on the floor, with flesh on the lowest bones.
    assert 0 < found[:, 2].min() < 0.06
    rotation = np.asarray(mj.frames(body, body.qpos0).rotation)
    np.testing.assert_allclose(rotation, np.broadcast_to(np.eye(3), rotation.shape), atol=1e-12)


def test_poses_agree_with_the_human_s(table, tmp_path):
    """The same turns of all joints move the joints alike."""
    human, _, theirs = table
    own = mj.load_skeleton(written(tmp_path / "own.json", theirs))
    at_rest, rng = positions(human, t_pose(human)), np.random.default_rng(0)
    turns = {n: Rotation.from_rotvec(0.5 * rng.standard_normal(3)) for n in at_rest}
    turns["L3"] = turns["RightShoulder"] = Rotation.identity()
    q = np.array(own.qpos0)
    for name in own.topology.joint_names[1:]:
        at = own.topology.joint_qpos[own.topology.joint_index(name)]
        turn = turns.get(name, Rotation.identity())
        q[at : at + 4] = turn.as_quat(scalar_first=True)
    # By hand, with the human's parents: frames parallel to the world's in the T-pose.
    R, p = {"Pelvis": Rotation.identity()}, {"Pelvis": np.asarray(own.qpos0)[:3]}
    names = human.topology.body_names
    for b, name in enumerate(names[2:], start=2):
        parent = names[human.topology.body_parent[b]]
        R[name] = R[parent] * turns[name]
        p[name] = p[parent] + R[parent].apply(at_rest[name] - at_rest[parent])
    place = positions(own, q)
    for name in sorted(place.keys() & p.keys()):
        np.testing.assert_allclose(place[name], p[name], atol=1e-9, err_msg=name)


def test_all_kinds_of_files_say_the_same(table, tmp_path):
    _, _, theirs = table
    wanted = mj.load_skeleton(written(tmp_path / "own.json", theirs)).body_pos
    centimetres = written(tmp_path / "cm.json", 100 * theirs, unit="cm")
    by_name = [None if p < 0 else SMPL_JOINTS[p] for p in SMPL_PARENTS]
    rows = [
        f"{n},{p or ''},{x!r},{y!r},{z!r}"
        for n, p, (x, y, z) in zip(SMPL_JOINTS, by_name, theirs.tolist(), strict=True)
    ]
    (tmp_path / "own.csv").write_text("\n".join(["joint,parent,x,y,z", *rows]))
    np.savez(tmp_path / "own.npz", joints=SMPL_JOINTS, parents=SMPL_PARENTS, positions=theirs)
    unsigned = np.array([SMPL_PARENTS, range(24)]).astype(np.uint32)
    np.savez(tmp_path / "model.npz", J=theirs, kintree_table=unsigned)
    numbers = written(tmp_path / "numbers.json", theirs, joints=list(range(24)), parents=None)
    short = written(
        tmp_path / "short.json", theirs, parents=by_name,
        joints=[n.replace("left_", "L_").replace("right_", "R_") for n in SMPL_JOINTS],
    )  # fmt: skip
    parents = [p and p.replace("left_", "L_").replace("right_", "R_") for p in by_name]
    short.write_text(short.read_text().replace(json.dumps(by_name), json.dumps(parents)))
    for file in (
        centimetres, tmp_path / "own.csv", tmp_path / "own.npz", tmp_path / "model.npz", numbers,
        short,
    ):  # fmt: skip
        found = mj.load_skeleton(file).body_pos
        np.testing.assert_allclose(found, wanted, atol=1e-9, err_msg=str(file))


def test_any_upright_axes_will_do(table, tmp_path):
    _, ours, theirs = table
    wanted = mj.load_skeleton(written(tmp_path / "a.json", theirs)).body_pos
    backwards = ours * [-1, -1, 1]  # facing -X
    for number, places in enumerate((ours, backwards, theirs @ TO_FILE.T)):
        found = mj.load_skeleton(written(tmp_path / f"{number}.json", places)).body_pos
        np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_segments_by_xsens_names(tmp_path):
    human = mj.human(1.82)
    place = positions(human, np.asarray(human.qpos0))
    names = list(human.topology.body_names[1:])
    parents = ["" if p == 0 else human.topology.body_names[p] for p in human.topology.body_parent]
    file = written(
        tmp_path / "x.json", np.array(list(place.values())), joints=names, parents=parents[1:]
    )
    own = mj.load_skeleton(file)
    assert set(own.topology.body_names) == set(human.topology.body_names)
    for name, length in mj.segment_lengths(human).items():
        child = [c for c in names if human.topology.body_names[
            human.topology.body_parent[human.topology.body_index(c)]] == name]  # fmt: skip
        if len(child) == 1:
            offset = own.body_pos[own.topology.body_index(child[0])]
            assert np.linalg.norm(offset) == pytest.approx(length, abs=1e-9)
    assert mj.ball_jointed(own).nv == own.nv == mj.ball_jointed(human).nv


def test_it_moves_and_wears_boards(table, tmp_path):
    """Retargeted motion keeps the directions of the limbs; the suit of six finds its places."""
    from mocap_jax.simulation import named_suit

    _, _, theirs = table
    own = mj.load_skeleton(written(tmp_path / "own.json", theirs))
    walk = mj.builtin_motion("walking")
    part = mj.Motion(
        "walk", walk.body, mj.Trajectory(walk.trajectory.time[:9], walk.trajectory.q[300:309])
    )
    fitted = mj.retarget(part, own)
    assert fitted.facts["orientation_error_mean_deg"] < 5
    true, found = positions(part.body, part.trajectory.q[4]), positions(own, fitted.trajectory.q[4])
    for upper, lower in (("LeftUpperLeg", "LeftLowerLeg"), ("RightUpperArm", "RightForeArm")):
        a, b = (at[lower] - at[upper] for at in (true, found))
        assert a @ b / np.linalg.norm(a) / np.linalg.norm(b) > np.cos(np.radians(3))
    assert len(named_suit("sip6_tnt15", own).boards) == 6


def changed(values, at, to):
    values = list(values)
    values[at] = to
    return values


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"positions": None}, "no 'positions'"),
        ({"positions": [[0, 1]] * 24}, r"positions have shape \(24, 2\), expected \(joints, 3\)"),
        ({"positions": [["a", 1, 2]] * 24}, "positions must be numbers"),
        ({"positions": [[float("nan"), 1, 2]] * 24}, "the position of joint 0 is not finite"),
        ({"positions": [[0, 0, 0]] * 24}, "extend over 0 m"),
        ({"joints": None, "parents": None, "positions": [[0, 1, 2]] * 22},
         "SMPL.s 24 need no names"),
        ({"joints": list(range(1, 25))}, "joint 24 is none of SMPL's 0 to 23"),
        ({"joints": changed(SMPL_JOINTS, 5, "left_knee")}, "'left_knee' is there 2 times"),
        ({"joints": changed(SMPL_JOINTS, 5, "")}, "joint 5 has no name"),
        ({"joints": SMPL_JOINTS[:-1]}, "23 joints, but 24 positions"),
        ({"joints": "pelvis"}, "'joints' must be a list"),
        ({"joints": changed(SMPL_JOINTS, 1, "haunch"), "parents": list(SMPL_PARENTS)},
         "no joint for LeftUpperLeg"),
        ({"joints": changed(SMPL_JOINTS, 1, "haunch"), "parents": None}, "no 'parents'"),
        ({"parents": changed(SMPL_PARENTS, 4, "left_hop")}, "unknown joint .left_hop.; valid"),
        ({"parents": changed(SMPL_PARENTS, 4, -1)}, "2 joints without parent"),
        ({"parents": changed(SMPL_PARENTS, 0, 4)}, "0 joints without parent"),
        ({"parents": changed(SMPL_PARENTS, 1, 4)}, "'left_hip' is among its own ancestors"),
        ({"unit": "inch"}, "unknown unit 'inch'; valid: m, cm, mm"),
    ],
)  # fmt: skip
def test_wrong_files(table, tmp_path, entries, words):
    file = written(tmp_path / "wrong.json", table[2], **entries)
    with pytest.raises(InputError, match=words) as caught:
        mj.load_skeleton(file)
    assert str(file) in str(caught.value)


def test_wrong_places(table, tmp_path):
    _, _, theirs = table
    with pytest.raises(InputError, match=r"in cm\? say unit='cm'"):
        mj.load_skeleton(written(tmp_path / "cm.json", 100 * theirs))
    assert mj.load_skeleton(tmp_path / "cm.json", unit="cm").nv == 75
    with pytest.raises(InputError, match="unknown unit 'ft'"):
        mj.load_skeleton(tmp_path / "cm.json", unit="ft")
    with pytest.raises(InputError, match="feet point backwards"):
        mj.load_skeleton(written(tmp_path / "mirror.json", theirs * [1, 1, -1]))
    oblique = Rotation.from_euler("z", 45, degrees=True).apply(theirs)
    with pytest.raises(InputError, match="does not stand along the axes"):
        mj.load_skeleton(written(tmp_path / "oblique.json", oblique))


def test_other_files(tmp_path):
    for name, text, words in (
        ("a.pkl", "", "unknown kind of skeleton '.pkl'; valid: .json, .npz, .csv"),
        ("none.json", None, "no such file"),
        ("a.json", "{", "not valid JSON"),
        ("b.json", "[1]", "expected an object"),
        ("a.npz", "no zip", "not a readable NPZ file"),
        ("a.csv", "joint,x,y,z\npelvis,0,0,0", "no column 'parent'"),
        ("b.csv", "joint,parent,x,y,z\npelvis,,0,0", "row 2 has 4 of the 5 values"),
    ):
        file = tmp_path / name
        if text is not None:
            file.write_text(text)
        with pytest.raises(InputError, match=words) as caught:
            mj.load_skeleton(file)
        assert str(file) in str(caught.value)
