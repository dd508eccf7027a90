"""Joint angles: anatomical directions, gimbal lock, continuity; tables."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.solution.anatomy import rotation_labels
from mocap_jax.solution.angles import joint_angles, root_relative_angles
from mocap_jax.solution.cardan import (
    cardan_zxy,
    continuous,
    locked,
    nearest_solution,
    other_solution,
)
from mocap_jax.solution.poses import segment_poses
from mocap_jax.trajectory import Trajectory

sys.path.insert(0, str(Path(__file__).parents[1] / "metrics"))
from small_person import person, solution, swing


def matrix(angles):
    return Rotation.from_euler("ZXY", angles).as_matrix()


def test_cardan_against_scipy():
    angles = np.random.default_rng(0).uniform(-1.5, 1.5, (200, 3))
    np.testing.assert_allclose(cardan_zxy(matrix(angles)), angles, atol=1e-12)
    np.testing.assert_allclose(matrix(other_solution(angles)), matrix(angles), atol=1e-12)


def test_continuation_passes_the_lock_and_full_turns():
    time = np.linspace(0, 1, 300)[:, None]
    true = np.hstack([8.0 * time, 0.3 + 2.2 * time, -0.4 * time])
    got = continuous(cardan_zxy(matrix(true)))
    np.testing.assert_allclose(got, true, atol=1e-9)
    assert np.allclose(nearest_solution(cardan_zxy(matrix(true)), true), true)


@pytest.mark.parametrize(
    ("joint", "world_axis", "expected"),
    [
        # Model in T-pose, facing +x, left = +y. A rotation about a world axis from there.
        ("left_hip", (0, -1, 0), {"LeftUpperLeg/flexion": 0.3}),
        ("right_hip", (0, -1, 0), {"RightUpperLeg/flexion": 0.3}),
        ("left_hip", (1, 0, 0), {"LeftUpperLeg/abduction": 0.3}),
        ("right_hip", (-1, 0, 0), {"RightUpperLeg/abduction": 0.3}),
        ("left_hip", (0, 0, -1), {"LeftUpperLeg/internal_rotation": 0.3}),
        ("right_hip", (0, 0, 1), {"RightUpperLeg/internal_rotation": 0.3}),
        ("left_knee", (0, 1, 0), {"LeftLowerLeg/flexion": 0.3}),
        ("left_ankle", (0, -1, 0), {"LeftFoot/dorsiflexion": 0.3}),
        ("neck", (0, 1, 0), {"Head/flexion": 0.3}),
        ("neck", (1, 0, 0), {"Head/lateral_bending": 0.3}),
        ("neck", (0, 0, 1), {"Head/axial_rotation": 0.3}),
        # The arm goes down (left arm points to +y: about -x), from 90 degrees of abduction.
        ("left_shoulder", (-1, 0, 0), {"LeftUpperArm/abduction": np.pi / 2 - 0.3}),
        ("right_shoulder", (1, 0, 0), {"RightUpperArm/abduction": np.pi / 2 - 0.3}),
        # Forearm forward in T-pose.
        ("left_elbow", (0, 0, -1), {"LeftForeArm/flexion": 0.3}),
        ("right_elbow", (0, 0, 1), {"RightForeArm/flexion": 0.3}),
        # Palm down: the hand goes down.
        ("left_wrist", (-1, 0, 0), {"LeftHand/flexion": 0.3}),
        ("right_wrist", (1, 0, 0), {"RightHand/flexion": 0.3}),
        ("right_wrist", (0, 0, 1), {"RightHand/radial_deviation": 0.3}),
    ],
)
def test_named_directions(joint, world_axis, expected):
    body = person()
    topology = body.topology
    j = topology.joint_index(joint)
    q = np.array(body.qpos0)
    at = topology.joint_qpos[j]
    if topology.joint_types[j] == "ball":
        rotation = Rotation.from_rotvec(0.3 * np.array(world_axis))
        q[at : at + 4] = rotation.as_quat(scalar_first=True)
    else:
        q[at] = 0.3 * np.dot(np.asarray(body.joint_axis)[j], world_axis)
    names, angles = joint_angles(body, Trajectory(np.zeros(1), q[None]))
    segment = next(iter(expected)).split("/")[0]
    got = {n: angles[0, i] for i, n in enumerate(names) if n.startswith(segment + "/")}
    for name, value in got.items():
        assert value == pytest.approx(expected.get(name, 0.0), abs=1e-9), name
    assert expected.keys() <= got.keys()


def test_root_relative_angles_follow_another_motion():
    """Beyond a quarter turn of abduction the triple nearest to the other motion is taken."""
    body = person()
    joint = body.topology.joint_index("right_shoulder")
    at = body.topology.joint_qpos[joint]
    down = np.linspace(0.0, -0.8, 20)  # from the T-pose upwards: abduction 90 degrees and more
    q = np.repeat(np.asarray(body.qpos0)[None], 20, 0)
    q[:, at : at + 4] = Rotation.from_rotvec(down[:, None] * [1.0, 0.0, 0.0]).as_quat(
        scalar_first=True
    )
    R, _ = segment_poses(body, q)
    true = np.stack([0 * down, np.pi / 2 - down, 0 * down], axis=1)
    names, angles = root_relative_angles(body, R, "RightUpperArm", true)
    assert names == ("flexion", "abduction", "internal_rotation")
    np.testing.assert_allclose(angles[1:], true[1:], atol=1e-6)
    assert locked(true * [1, -1, 1], np.deg2rad(5)).sum() == 3


def test_unknown_names_use_the_world_axes():
    from mocap_jax.body import load_body

    body = load_body(
        '<mujoco><worldbody><body name="lower"><joint name="j" type="ball"/><geom size="0.1"/>'
        "</body></worldbody></mujoco>"
    )
    quat = Rotation.from_rotvec([0, 0, 0.4]).as_quat(scalar_first=True)
    names, angles = joint_angles(body, Trajectory(np.zeros(1), quat[None]))
    assert names == ("lower/flexion", "lower/lateral_bending", "lower/axial_rotation")
    np.testing.assert_allclose(angles, [[0, 0, 0.4]], atol=1e-12)


def test_tables():
    body = person()
    made = solution(body, swing(body), covariance=np.repeat(0.01 * np.eye(body.nv)[None], 60, 0))
    data = made.to_xarray()
    assert data.joint_angle.attrs["units"] == "rad" and data.joint_angle.shape[0] == 60
    assert data.time.attrs["units"] == "s"
    np.testing.assert_allclose(data.standard_deviation, 0.1)
    pelvis = data.segment_position.sel(segment="Pelvis")
    np.testing.assert_allclose(pelvis, np.asarray(made.trajectory.q)[:, :3])
    frame = made.to_dataframe()
    assert frame.index.name == "time" and len(frame) == 60
    assert frame.attrs["units"]["root/px"] == "m"
    angle = data.joint_angle.sel(angle="LeftForeArm/flexion")
    np.testing.assert_allclose(frame["LeftForeArm/flexion"], angle)


@pytest.mark.parametrize(
    ("opensim", "own"),
    [("femur_r", "RightUpperLeg"), ("tibia_l", "LeftLowerLeg"), ("calcn_l", "LeftFoot"),
     ("humerus_r", "RightUpperArm"), ("radius_l", "LeftForeArm"), ("torso", "T8")],
)  # fmt: skip
def test_opensims_segments_have_the_angles_of_ours(opensim: str, own: str) -> None:
    assert rotation_labels(opensim) == rotation_labels(own)
