"""OpenSim's tables and TRC, read back by independent short readers."""

from __future__ import annotations

import numpy as np
import pytest
from io_samples import random_poses, random_solution
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body
from mocap_jax.body.opensim import pose_from_coordinates
from mocap_jax.errors import InputError
from mocap_jax.io import export_motion
from mocap_jax.io.world_frames import world_frames
from mocap_jax.motion import Motion, builtin_motion, human
from mocap_jax.solution.angles import joint_angles
from mocap_jax.trajectory import Trajectory

# OpenSim's (x, y, z), Y up, from ours, Z up.
TO_GROUND = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])

OSIM = """<OpenSimDocument Version="40000"><Model name="two"><BodySet><objects>
<Body name="base"><mass>1</mass><mass_center>0 0 0</mass_center><inertia>1 1 1 0 0 0</inertia>
</Body><Body name="leg"><mass>1</mass><mass_center>0 0 0</mass_center><inertia>1 1 1 0 0 0</inertia>
</Body></objects></BodySet><JointSet><objects>
<FreeJoint name="ground_base"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/base</socket_child_frame><coordinates>{free}</coordinates></FreeJoint>
<PinJoint name="knee"><socket_parent_frame>/bodyset/base</socket_parent_frame>
<socket_child_frame>/bodyset/leg</socket_child_frame><coordinates><Coordinate name="knee_angle">
<range>-2 2</range></Coordinate></coordinates></PinJoint></objects></JointSet></Model>
</OpenSimDocument>""".format(
    free="".join(f'<Coordinate name="base_{n}"/>' for n in ("rx", "ry", "rz", "tx", "ty", "tz"))
)


def read_table(path) -> tuple[dict[str, str], list[str], list[list[str]]]:
    """Header, names and cells of a MOT or STO file."""
    lines = path.read_text().splitlines()
    end = lines.index("endheader")
    header = dict(line.split("=", 1) for line in lines[:end] if "=" in line)
    return header, lines[end + 1].split("\t"), [x.split("\t") for x in lines[end + 2 :]]


def test_coordinates_of_an_opensim_model_come_back(tmp_path):
    body = load_body(OSIM)
    generator = np.random.default_rng(0)
    given = {f"base_{n}": generator.uniform(-1, 1, 5) for n in ("rx", "ry", "rz", "tx", "ty", "tz")}
    given["knee_angle"] = generator.uniform(-1, 1, 5)
    q = np.array(
        [pose_from_coordinates(body, {n: float(x[k]) for n, x in given.items()}) for k in range(5)]
    )
    time = 0.2 + np.arange(5) / 50
    export_motion(tmp_path / "x.mot", Motion("test", body, Trajectory(time, q)))
    header, names, cells = read_table(tmp_path / "x.mot")
    assert header["inDegrees"] == "yes"
    assert (int(header["nRows"]), int(header["nColumns"])) == (5, 8)
    assert names == ["time", *given]
    values = np.array(cells, float)
    np.testing.assert_allclose(values[:, 0], time, atol=1e-9)
    for name, column in zip(names[1:], values[:, 1:].T, strict=True):
        expected = given[name] if name.startswith("base_t") else np.degrees(given[name])
        np.testing.assert_allclose(column, expected, atol=1e-7, err_msg=name)
    export_motion(tmp_path / "x.sto", Motion("test", body, Trajectory(time, q)))
    assert (tmp_path / "x.sto").read_text() == (tmp_path / "x.mot").read_text()


def test_coordinates_of_another_body_are_its_joint_angles(tmp_path):
    body = human(height=1.8)
    motion = builtin_motion("walking", body=body)
    short = Motion("test", body, Trajectory(motion.trajectory.time[:40], motion.trajectory.q[:40]))
    export_motion(tmp_path / "x.mot", short)
    _, names, cells = read_table(tmp_path / "x.mot")
    table = dict(zip(names, np.array(cells, float).T, strict=True))
    ours, angles = joint_angles(body, short.trajectory)
    for name, column in zip(ours, angles.T, strict=True):
        np.testing.assert_allclose(table[name], np.degrees(column), atol=1e-6)
    position = np.asarray(short.trajectory.q)[:, :3] @ TO_GROUND.T
    found = np.stack([table[f"Pelvis_t{x}"] for x in "xyz"], axis=1)
    np.testing.assert_allclose(found, position, atol=1e-8)


def test_orientations_are_those_of_segments_in_opensims_ground(tmp_path, body):
    solution = random_solution(body)
    export_motion(tmp_path / "x.orientations.sto", solution)
    header, names, cells = read_table(tmp_path / "x.orientations.sto")
    assert header["DataType"] == "Quaternion"
    assert names[1:] == list(body.topology.body_names[1:])
    R, _ = world_frames(body, np.asarray(solution.trajectory.q))
    for k, row in enumerate(cells):
        for b, cell in enumerate(row[1:], start=1):
            quat = np.array(cell.split(","), float)
            seen = Rotation.from_quat(quat, scalar_first=True).as_matrix()
            np.testing.assert_allclose(seen, TO_GROUND @ R[k, b], atol=1e-9)


def test_trc_has_joint_centres_and_sites(tmp_path, body):
    q = random_poses(body, np.random.default_rng(0), 6)
    time = np.arange(6) / 100
    export_motion(tmp_path / "x.trc", Motion("test", body, Trajectory(time, q)))
    lines = (tmp_path / "x.trc").read_text().splitlines()
    assert lines[0].startswith("PathFileType\t4\t(X/Y/Z)")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    assert (header["Units"], header["NumFrames"], float(header["DataRate"])) == ("mm", "6", 100.0)
    names = [n for n in lines[3].split("\t")[2:] if n]
    assert len(names) == len(set(names)) == int(header["NumMarkers"])
    assert lines[4].split("\t")[2:5] == ["X1", "Y1", "Z1"]
    assert lines[5] == ""
    values = np.array([line.split("\t") for line in lines[6:]], float)
    assert values[:, 0].tolist() == [1, 2, 3, 4, 5, 6]
    points = values[:, 2:].reshape(6, len(names), 3)
    R, p = world_frames(body, q)
    topology = body.topology
    for s, name in enumerate(topology.site_names):
        b = topology.site_body[s]
        expected = (p[:, b] + R[:, b] @ np.asarray(body.site_pos)[s]) @ TO_GROUND.T * 1000
        at = topology.nbody - 1 + s
        np.testing.assert_allclose(points[:, at], expected, atol=1e-5, err_msg=name)
    child = next(b for b in range(2, topology.nbody) if topology.joints_of_body(b))
    pivot = np.asarray(body.joint_pos)[topology.joints_of_body(child)[-1]]
    centre = (p[:, child] + R[:, child] @ pivot) @ TO_GROUND.T * 1000
    np.testing.assert_allclose(points[:, child - 1], centre, atol=1e-5)


def test_poses_that_cannot_be_written_are_refused(tmp_path, body):
    q = random_poses(body, np.random.default_rng(0), 3)
    q[1] = np.nan
    for name in ("x.mot", "x.trc", "x.orientations.sto"):
        with pytest.raises(InputError, match=f"{name}: poses that are not finite"):
            export_motion(tmp_path / name, Motion("test", body, Trajectory(np.arange(3.0), q)))
        assert not (tmp_path / name).exists()
    uneven = Trajectory(np.array([0.0, 0.1, 0.5]), random_poses(body, np.random.default_rng(0), 3))
    with pytest.raises(InputError, match="evenly spaced"):
        export_motion(tmp_path / "x.trc", Motion("test", body, uneven))
