"""Errors against SciPy's rotations and C MuJoCo's kinematics."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from small_person import moved, person, person_xml, recording, setup, solution, swing

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.metrics import evaluate, interpolate
from mocap_jax.trajectory import Trajectory


@pytest.fixture(scope="module")
def body():
    return person()


@pytest.fixture(scope="module")
def truth(body):
    return swing(body)


@pytest.fixture(scope="module")
def noisy(body, truth):
    delta = np.random.default_rng(3).normal(0.0, 0.1, (len(truth.time), body.nv))
    return solution(body, Trajectory(truth.time, moved(body, np.asarray(truth.q), delta)))


def mujoco_poses(scale, q):
    """World rotations and positions of all bodies by C MuJoCo."""
    model = mujoco.MjModel.from_xml_string(person_xml(scale))
    data = mujoco.MjData(model)
    R, p = [], []
    for row in np.asarray(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        R.append(data.xmat.reshape(-1, 3, 3).copy())
        p.append(data.xpos.copy())
    return np.array(R), np.array(p)


def angle_deg(R_a, R_b):
    return np.rad2deg(
        [(Rotation.from_matrix(a).inv() * Rotation.from_matrix(b)).magnitude()
         for a, b in zip(R_a, R_b, strict=True)]
    )  # fmt: skip


def test_identical_motion_has_no_error(body, truth):
    table = evaluate(solution(body, truth), recording(truth))
    worst = max(v for values in table.errors.values() for v in values.values())
    assert worst < 1e-9


def test_against_scipy_and_mujoco(body, truth, noisy):
    """Every metric recomputed, the true body being 20 % larger."""
    table = evaluate(noisy, recording(truth, scale=1.2))
    names = list(body.topology.body_names)
    R, p = mujoco_poses(1.0, noisy.trajectory.q)
    R_true, p_true = mujoco_poses(1.2, truth.q)
    of = names.index

    def joint(rotation, child, parent):
        return np.swapaxes(rotation[:, of(parent)], 1, 2) @ rotation[:, of(child)]

    knee = angle_deg(
        joint(R, "LeftLowerLeg", "LeftUpperLeg"), joint(R_true, "LeftLowerLeg", "LeftUpperLeg")
    )
    mean, rmse = table["orientation_error_mean_deg"], table["orientation_error_rmse_deg"]
    assert mean["LeftLowerLeg"] == pytest.approx(knee.mean(), abs=1e-6)
    assert rmse["LeftLowerLeg"] == pytest.approx(np.sqrt((knee**2).mean()), abs=1e-6)
    world = angle_deg(R[:, of("RightHand")], R_true[:, of("RightHand")])
    assert table["segment_orientation_error_mean_deg"]["RightHand"] == pytest.approx(world.mean())
    at = [
        poses[:, of("RightHand")] - poses[:, of("Pelvis")] for poses in (p, p_true)
    ]  # the joint centre is the body's origin here
    distance = 100 * np.linalg.norm(at[0] - at[1], axis=1).mean()
    assert table["position_error_mean_cm"]["RightHand"] == pytest.approx(distance)
    neck = angle_deg(joint(R, "Head", "Pelvis"), joint(R_true, "Head", "Pelvis"))
    relative = table["root_relative_orientation_error_mean_deg"]
    assert relative["Head"] == pytest.approx(neck.mean())
    std = table["root_relative_orientation_error_std_deg"]["Head"]
    assert std == pytest.approx(neck.std())
    three = [relative[n] for n in ("Head", "RightUpperArm", "LeftUpperLeg")]
    assert mean["mean_table1"] == pytest.approx(np.mean(three))
    seen = [mean[n] for n in ("Head", "RightUpperArm", "RightForeArm", "LeftUpperLeg")]
    assert mean["mean_observed"] == pytest.approx(np.mean(seen))
    assert set(table.observed) == {"Head", "RightUpperArm", "RightForeArm", "LeftUpperLeg"}
    joints = [v for k, v in mean.items() if not k.startswith("mean")]
    assert "Pelvis" not in mean and len(joints) == 13
    assert mean["mean"] == pytest.approx(np.mean(joints))


def test_known_perturbation_gives_its_angle(body, truth):
    """0.3 rad in the neck and the elbow: 17.19 degrees there and nowhere else."""
    topology = body.topology
    delta = np.zeros((len(truth.time), body.nv))
    delta[:, topology.joint_dof[topology.joint_index("neck")] + 1] = 0.3
    delta[:, topology.joint_dof[topology.joint_index("left_elbow")]] = -0.3
    q = moved(body, np.asarray(truth.q), delta)
    table = evaluate(solution(body, Trajectory(truth.time, q)), recording(truth))
    mean = table["orientation_error_mean_deg"]
    expected = np.rad2deg(0.3)
    assert mean["Head"] == pytest.approx(expected)
    assert mean["LeftForeArm"] == pytest.approx(expected)
    assert mean["RightUpperArm"] < 1e-6
    assert table["joint_angle_rmse_deg"]["LeftForeArm/flexion"] == pytest.approx(expected)
    assert mean["mean"] == pytest.approx(2 * expected / 13)


def test_observed_joints_of_one_of_several_people_have_a_mean(truth):
    body = load_body(person_xml().replace('name="', 'name="anna/'))
    delta = np.random.default_rng(5).normal(0.0, 0.1, (len(truth.time), body.nv))
    estimate = Trajectory(truth.time, moved(body, np.asarray(truth.q), delta))
    seen = ("anna/Head", "anna/RightForeArm")
    table = evaluate(solution(body, estimate, observed=seen), solution(body, truth))
    for metric in ("orientation_error_mean_deg", "position_error_mean_cm"):
        errors = table[metric]
        assert errors["mean_observed"] == pytest.approx(np.mean([errors[n] for n in seen]))
        assert errors["mean_observed"] != errors["mean"]


def test_exchanging_solution_and_reference_changes_nothing(body, truth, noisy):
    there = evaluate(noisy, solution(body, truth))
    back = evaluate(solution(body, truth), noisy)
    for metric in ("orientation_error_mean_deg", "position_error_mean_cm"):
        assert there[metric] == pytest.approx(back[metric])


def test_angles_do_not_wrap(body):
    """An elbow at 179 and -179 degrees is 2 degrees apart; so is a twisted head."""
    topology = body.topology
    first, second = (np.repeat(np.asarray(body.qpos0)[None], 5, 0) for _ in range(2))
    elbow = topology.joint_qpos[topology.joint_index("right_elbow")]
    first[:, elbow], second[:, elbow] = np.deg2rad(179), np.deg2rad(-179)
    neck = topology.joint_dof[topology.joint_index("neck")] + 2
    for q, angle in ((first, 179.0), (second, -179.0)):
        delta = np.zeros((5, body.nv))
        delta[:, neck] = np.deg2rad(angle)
        q[:] = moved(body, q, delta)
    time = np.arange(5) / 100
    table = evaluate(
        solution(body, Trajectory(time, first)), solution(body, Trajectory(time, second))
    )
    assert table["joint_angle_rmse_deg"]["RightForeArm/flexion"] == pytest.approx(2.0)
    assert table["joint_angle_rmse_deg"]["Head/axial_rotation"] == pytest.approx(2.0)
    assert table["orientation_error_mean_deg"]["Head"] == pytest.approx(2.0)


def test_interpolation_is_slerp(body, truth):
    time = np.linspace(0.003, 0.577, 33)
    q = interpolate(body, truth, time)
    topology = body.topology
    start = topology.joint_qpos[topology.joint_index("left_hip")]
    quats = Rotation.from_quat(np.asarray(truth.q)[:, start : start + 4], scalar_first=True)
    expected = Slerp(truth.time, quats)(time)
    got = Rotation.from_quat(q[:, start : start + 4], scalar_first=True)
    assert (expected.inv() * got).magnitude().max() < 1e-7
    knee = topology.joint_qpos[topology.joint_index("left_knee")]
    np.testing.assert_allclose(q[:, knee], np.interp(time, truth.time, truth.q[:, knee]))


def test_scored_from(body, truth, noisy):
    late = evaluate(noisy, recording(truth), from_time=0.3)
    assert late.frames == 30 and late.interval[0] == pytest.approx(0.3)
    declared = evaluate(
        solution(body, noisy.trajectory, setup=setup(score_from=0.3)), recording(truth)
    )
    assert declared.errors == late.errors


def test_more_frames_than_one_chunk(body):
    longer = swing(body, frames=1100)
    table = evaluate(solution(body, longer), recording(longer))
    assert table.frames == 1100 and table["orientation_error_mean_deg"]["mean"] < 1e-9


def test_input_errors(body, truth, noisy):
    import dataclasses

    from mocap_jax.body import load_body

    with pytest.raises(InputError, match="no truth"):
        evaluate(noisy, dataclasses.replace(recording(truth), truth=None))
    with pytest.raises(InputError, match="no frames to score"):
        evaluate(noisy, recording(truth), from_time=9.0)
    other = load_body(
        '<mujoco><worldbody><body name="x"><joint name="j" type="ball"/>'
        '<geom size="0.1"/></body></worldbody></mujoco>'
    )
    with pytest.raises(InputError, match="no joint in common"):
        evaluate(noisy, solution(other, Trajectory(truth.time, np.zeros((60, 4)) + 0.5)))


def test_table_as_text_and_data(truth, noisy):
    table = evaluate(noisy, recording(truth))
    text = str(table)
    for part in ("Observed joints", "Relative to Pelvis", "[deg]", "[cm]"):
        assert part in text
    assert max(len(line) for line in text.splitlines()) <= 100
    frame = table.to_dataframe()
    mean = table["orientation_error_mean_deg"]
    assert frame.loc["Head", "orientation_error_mean_deg"] == mean["Head"]
    assert frame.attrs["units"]["position_error_mean_cm"] == "cm"
    data = table.to_xarray()
    assert data.orientation_error_mean_deg.attrs["units"] == "deg"
    assert float(data.orientation_error_mean_deg.sel(joint="mean")) == mean["mean"]
