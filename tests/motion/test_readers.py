"""Motion readers against independent forward kinematics written from the formats' definitions."""

from __future__ import annotations

import re
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.motion import Motion, body_from_asf, body_from_bvh, load_motion, xsens_name

UNIT = 0.0254 / 0.45
# The files' axes X left, Y up, Z forward as ours: X forward, Y left, Z up.
AXES = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])


def turn(axis: str, degrees: float) -> np.ndarray:
    """Rotation about one axis, written out."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


def fixed_xyz(rx: float, ry: float, rz: float) -> np.ndarray:
    return turn("z", rz) @ turn("y", ry) @ turn("x", rx)


def positions(motion: Motion, frame: int) -> dict[str, np.ndarray]:
    """Body origins by C MuJoCo."""
    model = motion.body.mujoco_model()
    data = mujoco.MjData(model)
    data.qpos = np.asarray(motion.trajectory.q[frame])
    mujoco.mj_kinematics(model, data)
    return {model.body(i).name: data.xpos[i].copy() for i in range(1, model.nbody)}


def asf_reference(asf: str, frame: list[str]) -> dict[str, np.ndarray]:
    """Start point [m, ours] of each bone, by the definition: W = W_parent C R C^-1."""
    angles = {line.split()[0]: [float(v) for v in line.split()[1:]] for line in frame}
    root = angles["root"]
    start, end = {"root": np.array(root[:3])}, {"root": np.array(root[:3])}
    W = {"root": fixed_xyz(*root[3:])}
    blocks = {}
    for block in re.findall(r"begin\s+id.*?end", asf, re.S):
        entries = dict(re.findall(r"(name|direction|length|axis|dof) +([^\n]*)", block))
        blocks[entries["name"].strip()] = entries
    for line in asf.split(":hierarchy")[1].splitlines():
        parent, *children = line.split() or [""]
        for child in children:
            entries = blocks[child]
            C = fixed_xyz(*map(float, entries["axis"].split()[:3]))
            values = dict(zip(entries.get("dof", "").split(), angles.get(child, []), strict=True))
            R = fixed_xyz(values.get("rx", 0), values.get("ry", 0), values.get("rz", 0))
            W[child] = W[parent] @ C @ R @ C.T
            start[child] = end[parent]
            reach = np.array(entries["direction"].split(), float) * float(entries["length"])
            end[child] = start[child] + W[child] @ reach
    return {name: UNIT * AXES @ p for name, p in start.items()}


@pytest.mark.parametrize("clip", ["02_01", "01_06", "03_04"])
def test_amc_positions_follow_the_definition(shared_data: Path, clip: str) -> None:
    folder = shared_data / "cmu_mocap"
    motion = load_motion(folder / f"{clip}.amc")
    frames = re.split(r"\n\d+\n", (folder / f"{clip}.amc").read_text())[1:]
    assert len(frames) == len(motion.trajectory.q)
    asf = (folder / f"{clip[:2]}.asf").read_text()
    for frame in (0, 100, len(frames) - 1):
        found = positions(motion, frame)
        for name, expected in asf_reference(asf, frames[frame].strip().splitlines()).items():
            segment = xsens_name(name)
            np.testing.assert_allclose(found[segment], expected, atol=1e-9, err_msg=name)


def bvh_reference(path: Path, row: int) -> dict[str, np.ndarray]:
    """World position [file units] of each joint, by a recursive descent over the text."""
    header, motion = path.read_text().split("MOTION")
    values = iter([float(v) for v in motion.strip().splitlines()[2 + row].split()])
    found: dict[str, np.ndarray] = {}
    stack: list[tuple[np.ndarray, np.ndarray]] = [(np.eye(3), np.zeros(3))]
    name, offset = "", np.zeros(3)
    for words in (line.split() for line in header.splitlines() if line.strip()):
        if words[0] in ("ROOT", "JOINT", "End"):
            name = words[1]
        elif words[0] == "OFFSET":
            offset = np.array(words[1:], float)
            R, p = stack[-1]
            stack.append((R, p + R @ offset))
            found[name] = stack[-1][1]
        elif words[0] == "CHANNELS":
            R, p = stack.pop()
            for channel in words[2:]:
                value = next(values)
                if channel.endswith("position"):
                    p = np.where(np.array(list("XYZ")) == channel[0], value, p)
                else:
                    R = R @ turn(channel[0].lower(), value)
            stack.append((R, p))
            found[name] = p
        elif words[0] == "}":
            stack.pop()
    return found


@pytest.mark.parametrize(("clip", "scale"), [("13_29.bvh", UNIT), ("60_13_salsa_60Hz.bvh", 0.01)])
def test_bvh_positions_follow_the_definition(shared_data: Path, clip: str, scale: float) -> None:
    path = shared_data / "cmu_mocap" / clip
    motion = load_motion(path)
    assert motion.facts["skipped_frames"] == 1
    assert motion.facts["metres_per_unit"] == pytest.approx(scale)
    for frame in (0, 500, len(motion.trajectory.q) - 1):
        found = positions(motion, frame)
        for name, expected in bvh_reference(path, frame + 1).items():
            if name == "Site":
                continue
            segment = xsens_name(name)
            np.testing.assert_allclose(
                found[segment], scale * AXES @ expected, atol=1e-6, err_msg=name
            )


@pytest.mark.parametrize(
    ("clip", "frames"),
    [("01_06.amc", 5133), ("02_01.amc", 343), ("02_03.amc", 173), ("02_05.amc", 1854),
     ("02_07.amc", 2251), ("02_10.amc", 2645), ("03_04.amc", 4722), ("13_29.bvh", 4592),
     ("60_13_salsa_60Hz.bvh", 2271)],
)  # fmt: skip
def test_clips_load_fast_within_limits(shared_data: Path, clip: str, frames: int) -> None:
    start = time.perf_counter()
    motion = load_motion(shared_data / "cmu_mocap" / clip)
    assert time.perf_counter() - start < 10.0  # 2 s on a machine of its own
    body, q = motion.body, np.asarray(motion.trajectory.q)
    assert len(q) == frames
    for j, kind in enumerate(body.topology.joint_types):
        start_index = body.topology.joint_qpos[j]
        if kind == "hinge":
            lower, upper = np.asarray(body.joint_range[j])
            assert (q[:, start_index] >= lower - 1e-9).all(), body.topology.joint_names[j]
            assert (q[:, start_index] <= upper + 1e-9).all(), body.topology.joint_names[j]
        elif kind == "ball":
            quat = q[:, start_index : start_index + 4]
            assert ((quat[1:] * quat[:-1]).sum(axis=1) > 0).all()


def test_walker_is_upright_at_a_human_height(shared_data: Path) -> None:
    motion = load_motion(shared_data / "cmu_mocap" / "02_01.amc")
    for frame in range(0, 343, 20):
        found = positions(motion, frame)
        lowest = min(p[2] for p in found.values())
        assert -0.07 < lowest < 0.09
        assert 1.4 < found["Head"][2] < 1.6  # base of the head; its top is 9 cm higher
    first, last = positions(motion, 0), positions(motion, 342)
    walked = last["Pelvis"] - first["Pelvis"]
    facing = np.cross(first["LeftUpperLeg"] - first["RightUpperLeg"], [0, 0, 1.0])
    assert np.dot(walked, facing) > 0.9 * np.linalg.norm(walked) * np.linalg.norm(facing)


def test_asf_body_has_the_segments_and_degrees_of_freedom(shared_data: Path) -> None:
    body = body_from_asf(shared_data / "cmu_mocap" / "02.asf")
    assert body.nv == 62
    assert body.topology.joint_names[0] == "root"
    assert body.topology.body_names[1] == "Pelvis"
    for name in ("L5", "T8", "Head", "LeftUpperArm", "RightFoot", "RightToe", "LeftShoulder"):
        assert name in body.topology.body_names
    assert {"Head", "LeftFoot_rx", "LeftFoot_rz"} <= set(body.topology.joint_names)


TINY_BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Head
  {
    OFFSET 0 %s 0
    CHANNELS 3 Zrotation Yrotation Xrotation
    End Site
    {
      OFFSET 0 1 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.02
0 1 0 0 0 0 0 0 0
0 1 0 5 0 0 10 0 0
0 1 0 6 0 0 %s 0 0
"""


def test_bvh_still_joints_are_welded_and_units_are_stated(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(TINY_BVH % (5, 10))
    motion = load_motion(path)
    assert motion.body.nv == 6
    assert motion.facts["welded_joints"] == 1
    assert motion.facts["skipped_frames"] == 1
    assert motion.facts["frame_rate_hz"] == pytest.approx(50)
    assert motion.facts["metres_per_unit"] == pytest.approx(UNIT)
    path.write_text(TINY_BVH % (150, 11))
    assert body_from_bvh(path).nv == 9
    assert load_motion(path).facts["metres_per_unit"] == 0.01
    chosen = load_motion(path, scale=0.5, fps=10.0, skip=0)
    assert chosen.facts["metres_per_unit"] == 0.5
    np.testing.assert_allclose(np.asarray(chosen.trajectory.time), [0, 0.1, 0.2])
    assert float(chosen.trajectory.q[0, 2]) == pytest.approx(0.5)


def test_npz_round_trip(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text(TINY_BVH % (5, 12))
    motion = load_motion(tmp_path / "a.bvh")
    np.savez(tmp_path / "a.npz", time=np.asarray(motion.trajectory.time),
             q=np.asarray(motion.trajectory.q), body_xml=motion.body.xml)  # fmt: skip
    again = load_motion(tmp_path / "a.npz")
    np.testing.assert_array_equal(again.trajectory.q, motion.trajectory.q)
    assert again.body.topology == motion.body.topology


AMC = "#comment\n:FULLY-SPECIFIED\n:DEGREES\n1\n%s"


@pytest.fixture
def broken_amc(shared_data: Path, tmp_path: Path):
    """Writes a one-frame clip with one line changed; returns the path."""
    text = (shared_data / "cmu_mocap" / "02_01.amc").read_text()
    frame = re.split(r"\n\d+\n", text)[1]

    def write(old: str, new: str) -> Path:
        (tmp_path / "02.asf").write_bytes((shared_data / "cmu_mocap" / "02.asf").read_bytes())
        path = tmp_path / "02_99.amc"
        assert re.search(old, frame)
        path.write_text(AMC % re.sub(old, new, frame, count=1))
        return path

    return write


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (r"rtibia .*", "rtibia", r"02_99\.amc: line \d+: 'rtibia' needs 1 values, found 0"),
        (r"rtibia .*", "rtibia 1 2", "needs 1 values, found 2"),
        (r"rtibia .*", "tail 1", "no moving bone 'tail'; valid: root, "),
        (r"rtibia .*", "rtibia one", "'one' is not a number"),
        (r"rtibia .*", "rtibia nan", "not finite"),
        (r"rtibia .*\n", "", "frame 1 ends without bone 'rtibia'"),
        (r"rtibia (.*)\n", r"rtibia \1\nrtibia \1\n", "twice in frame 1"),
    ],
)  # fmt: skip
def test_amc_faults_are_named(broken_amc, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_motion(broken_amc(old, new))


def test_other_faults_are_named(shared_data: Path, tmp_path: Path) -> None:
    clip = tmp_path / "02_01.amc"
    clip.write_text("")
    with pytest.raises(InputError, match=r"02\.asf is not beside it"):
        load_motion(clip)
    (tmp_path / "02.asf").write_text(":version 1.10\n")
    with pytest.raises(InputError, match="no section :root"):
        load_motion(clip)
    with pytest.raises(InputError, match="the file is empty"):
        load_motion(clip, skeleton=shared_data / "cmu_mocap" / "02.asf")
    with pytest.raises(InputError, match=r"valid: \.amc, \.bvh, \.npz"):
        load_motion(tmp_path / "a.fbx")
    with pytest.raises(InputError, match="no such file"):
        load_motion(tmp_path / "a.bvh")
    with pytest.raises(InputError, match="fps must be a positive number"):
        load_motion(clip, fps=0.0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("HIERARCHY", "SOMETHING", "expected HIERARCHY"),
        ("MOTION", "", "'Frames: 3' is not understood here|no MOTION"),
        ("Frames: 3", "Frames: 4", "the header says 4 frames, the file holds 3"),
        ("0 1 0 5 0 0 10 0 0", "0 1 0 5 0 0 10 0", "needs 9 values, found 8"),
        ("0 1 0 5 0 0 10 0 0", "0 1 0 5 0 0 10 0 x", "line 20: 'x' is not a number"),
        ("Yposition", "Wposition", "unknown channel 'Wposition'; valid: Xposition"),
        ("Frame Time: 0.02", "Frame Time: 0", "frame time must be positive"),
    ],
)  # fmt: skip
def test_bvh_faults_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "a.bvh"
    path.write_text((TINY_BVH % (5, 10)).replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        load_motion(path)
