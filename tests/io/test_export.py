"""Exports are read back by independent readers and compared."""

from __future__ import annotations

import csv
import re

import mujoco
import numpy as np
import pytest
from io_samples import random_poses, random_solution
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.io import export_motion
from mocap_jax.io.bvh import euler_zxy_deg
from mocap_jax.io.world_frames import world_frames
from mocap_jax.motion import Motion, load_motion
from mocap_jax.trajectory import Trajectory


def read_bvh(text: str) -> tuple[dict[str, np.ndarray], float]:
    """World positions [m, Z up] of all joints of a BVH file, and its frame time."""
    hierarchy, motion = text.split("MOTION")
    rows = motion.strip().splitlines()
    frames, step = int(rows[0].split()[1]), float(rows[1].split()[2])
    values = np.array([[float(x) for x in row.split()] for row in rows[2:]])
    assert len(values) == frames
    positions, stack, at = {}, [], 0
    pending = ""
    for line in hierarchy.splitlines()[1:]:
        words = line.split()
        if words[0] in ("ROOT", "JOINT", "End"):
            pending = words[1] if words[0] != "End" else f"{stack[-1][0]}/end"
        elif words[0] == "{":
            parent = stack[-1] if stack else ("", np.tile(np.eye(3), (frames, 1, 1)), 0.0)
            stack.append([pending, parent[1], parent[2]])
        elif words[0] == "OFFSET":
            offset = np.array([float(x) for x in words[1:]])
            stack[-1][2] = stack[-1][2] + stack[-1][1] @ offset
            positions[stack[-1][0]] = stack[-1][2]
        elif words[0] == "CHANNELS":
            R = np.tile(np.eye(3), (frames, 1, 1))
            for channel in words[2:]:
                axis = "XYZ".index(channel[0])
                if channel.endswith("position"):
                    stack[-1][2] = stack[-1][2] + stack[-1][1][:, :, axis] * values[:, at, None]
                else:
                    R = R @ Rotation.from_euler(channel[0], values[:, at, None], True).as_matrix()
                at += 1
            stack[-1][1] = stack[-1][1] @ R
            positions[stack[-1][0]] = stack[-1][2]
        elif words[0] == "}":
            stack.pop()
    assert at == values.shape[1]
    return {n: np.stack([p[:, 2], p[:, 0], p[:, 1]], 1) / 100 for n, p in positions.items()}, step


SLIDING = """<mujoco><worldbody><body name="base" pos="1 2 3" quat="0.6 0.8 0 0">
<joint name="lift" type="slide" axis="0 0 1"/>
<joint name="turn" type="hinge" axis="0 1 0" pos="0.1 0 0.2"/>
<geom size="0.1"/>
<body name="arm one" pos="0 0 0.3"><joint name="a" axis="1 0 0" pos="0 0 -0.1"/>
<joint name="b" axis="0 1 0" pos="0.2 0 -0.1"/><geom size="0.1"/></body></body>
<body name="second" pos="0 1 0"><joint name="c" type="ball" pos="0 0.1 0"/><geom size="0.1"/></body>
</worldbody></mujoco>"""


def pivots_in_c(body, q):
    """World pivots of all bodies by C MuJoCo."""
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    out = {name: [] for name in body.topology.body_names[1:]}
    for pose in q:
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        for b, name in enumerate(body.topology.body_names[1:], start=1):
            joints = body.topology.joints_of_body(b)
            turning = [j for j in joints if body.topology.joint_types[j] in ("hinge", "ball")]
            if turning:
                local = model.jnt_pos[turning[-1]]
                out[name].append(data.xpos[b] + data.xmat[b].reshape(3, 3) @ local)
            else:
                out[name].append(data.xpos[b].copy())
    return {name: np.array(p) for name, p in out.items()}


@pytest.mark.parametrize("xml", [None, SLIDING])
def test_bvh_keeps_every_joint_centre(tmp_path, body, xml) -> None:
    body = load_body(xml) if xml else body
    q = random_poses(body, np.random.default_rng(3), 20)
    motion = Motion("m", body, Trajectory(np.arange(20) / 120, q))
    export_motion(tmp_path / "m.bvh", motion)
    positions, step = read_bvh((tmp_path / "m.bvh").read_text())
    assert step == pytest.approx(1 / 120, abs=1e-9)
    for name, expected in pivots_in_c(body, q).items():
        np.testing.assert_allclose(positions["_".join(name.split())], expected, atol=1e-6)


def test_bvh_reads_back_as_the_same_motion(tmp_path, body) -> None:
    q = random_poses(body, np.random.default_rng(4), 6)
    export_motion(tmp_path / "m.bvh", Motion("m", body, Trajectory(np.arange(6) / 60, q)))
    again = load_motion(tmp_path / "m.bvh", scale=0.01, skip=0)
    expected = pivots_in_c(body, q)
    _, found = world_frames(again.body, np.asarray(again.trajectory.q))
    for name, centres in expected.items():
        at = again.body.topology.body_index(name)
        np.testing.assert_allclose(found[:, at], centres, atol=1e-5)


def test_bvh_is_upright_and_at_rest_all_angles_are_zero(tmp_path, body) -> None:
    q = np.tile(np.asarray(body.qpos0), (3, 1))
    export_motion(tmp_path / "m.bvh", Motion("m", body, Trajectory(np.arange(3) / 60, q)))
    text = (tmp_path / "m.bvh").read_text()
    row = np.array(text.strip().splitlines()[-1].split(), float)
    np.testing.assert_allclose(row[:3], [0, 100, 0], atol=1e-6)  # 1 m up, in cm along Y
    np.testing.assert_allclose(row[3:], 0, atol=1e-6)
    assert len(re.findall("JOINT|ROOT", text)) == body.topology.nbody - 1


def test_euler_angles_survive_gimbal_lock() -> None:
    angles = np.array([[30.0, 90.0, 0.0], [10.0, -90.0, 20.0], [5.0, 89.9999999, 40.0]])
    R = Rotation.from_euler("ZXY", angles, True).as_matrix()
    back = Rotation.from_euler("ZXY", euler_zxy_deg(R), True).as_matrix()
    np.testing.assert_allclose(back, R, atol=1e-7)


def test_csv_has_degrees_and_all_digits(tmp_path, body) -> None:
    solution = random_solution(body)
    export_motion(tmp_path / "s.csv", solution)
    with open(tmp_path / "s.csv", newline="") as stream:
        header, *rows = list(csv.reader(stream))
    table = np.array(rows, float)
    assert header[:2] == ["time [s]", "root:x [m]"] and "RightKnee [deg]" in header
    knee = np.asarray(solution.trajectory.q)[:, body.topology.joint_qpos[2]]
    np.testing.assert_allclose(np.radians(table[:, header.index("RightKnee [deg]")]), knee)
    at = header.index("RightHip:qw")
    np.testing.assert_array_equal(table[:, at : at + 4], solution.trajectory.q[:, 7:11])


def test_npz_holds_the_arrays(tmp_path, body) -> None:
    solution = random_solution(body)
    export_motion(tmp_path / "s.npz", solution)
    with np.load(tmp_path / "s.npz", allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["q"], solution.trajectory.q)
        np.testing.assert_array_equal(arrays["v"], solution.trajectory.v)
        expected = np.einsum("tii->ti", solution.covariance)
        np.testing.assert_array_equal(arrays["covariance_diagonal"], expected)
        assert arrays["names"][0] == "root:x" and str(arrays["body_xml"]) == body.xml


def test_unknown_suffix_lists_the_valid_ones(tmp_path, body) -> None:
    with pytest.raises(InputError, match=r"'\.fbx'; valid: \.bvh, \.csv, \.npz"):
        export_motion(tmp_path / "s.fbx", random_solution(body))
    assert not list(tmp_path.iterdir())


def test_poses_that_are_not_finite_are_refused_as_bvh(tmp_path, body) -> None:
    q = np.full((4, body.nq), np.nan)
    motion = Motion("m", body, Trajectory(np.arange(4) / 60, q))
    with pytest.raises(InputError, match="not finite"):
        export_motion(tmp_path / "m.bvh", motion)
    assert not list(tmp_path.iterdir())
