"""Learning a pose prior, its files, and what it says of poses."""

from __future__ import annotations

import json

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.body import retract
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.pose_prior import JOINTS, PosePrior, anatomical_joint_rotations
from mocap_jax.pose_prior.learn import PACE_FLOOR, mirrored
from mocap_jax.pose_prior.rotations import joints_of
from mocap_jax.trajectory import Trajectory

LEGS = (("LeftUpperLeg", "Pelvis"), ("RightUpperLeg", "Pelvis"), ("LeftLowerLeg", "LeftUpperLeg"))


@pytest.fixture(scope="module")
def body():
    return mj.human()


def swinging(body, seed: int = 0, count: int = 4000) -> Motion:
    """Poses drawn independently about the reference pose, at 30 Hz."""
    rng = np.random.default_rng(seed)
    q = _many(body, rng, count)
    return Motion("drawn", body, Trajectory(np.arange(count) / 30, q), {})


def _many(body, rng, count: int) -> np.ndarray:
    import jax

    move = jax.jit(jax.vmap(lambda d: retract(body.topology, body.qpos0, d)))
    return np.asarray(move(jnp.asarray(0.2 * rng.normal(size=(count, body.nv)))))


def test_mean_and_covariance_of_drawn_poses_come_back(body):
    motion = swinging(body)
    prior = mj.learn_pose_prior({"a": motion}, joints=LEGS[:2], shrinkage=0.0, floor=1e-3)
    # Thighs are balls with one deviation for all axes; left and right are drawn apart.
    np.testing.assert_allclose(prior.covariance, 0.04 * np.eye(6), atol=0.004)
    rotation = anatomical_joint_rotations(body, np.asarray(motion.trajectory.q), LEGS[:2])
    assert prior.mahalanobis(rotation).mean() == pytest.approx(6.0, rel=0.02)
    assert prior.correlation_time == pytest.approx(1 / 30, rel=0.2)


def test_the_prior_is_the_same_for_both_sides(body):
    prior = mj.learn_pose_prior({"a": swinging(body, 1, 600)}, name="both")
    rotation = anatomical_joint_rotations(
        body, np.asarray(swinging(body, 2, 60).trajectory.q), JOINTS
    )
    np.testing.assert_allclose(
        prior.mahalanobis(rotation), prior.mahalanobis(mirrored(rotation, JOINTS)), rtol=1e-6
    )


def test_rotations_do_not_depend_on_how_frames_are_laid(body):
    """The knee bends about Z (to the right) of the anatomical frame."""
    q = np.array(body.qpos0)[None].copy()
    q[0, body.topology.joint_qpos[body.topology.joint_index("LeftLowerLeg_flexion")]] += 0.7
    start = anatomical_joint_rotations(body, np.array(body.qpos0)[None], LEGS)
    turned = np.swapaxes(start, -1, -2) @ anatomical_joint_rotations(body, q, LEGS)
    vectors = Rotation.from_matrix(turned[0]).as_rotvec()
    np.testing.assert_allclose(vectors[:2], 0.0, atol=1e-12)
    np.testing.assert_allclose(abs(vectors[2]), [0, 0, 0.7], atol=0.02)


def test_of_segments_is_the_marginal(body):
    prior = mj.default_pose_prior()
    some = prior.of_segments(["Pelvis", "LeftUpperLeg", "LeftLowerLeg"])
    assert some.joints == (("LeftUpperLeg", "Pelvis"), ("LeftLowerLeg", "LeftUpperLeg"))
    at = 3 * prior.joints.index(some.joints[0])
    np.testing.assert_array_equal(
        some.covariance[:3, :3], prior.covariance[at : at + 3, at : at + 3]
    )
    assert prior.of_segments(["Pelvis"]).joints == ()


def test_the_default_prior_knows_knees():
    """They bend by tens of degrees, about one axis."""
    prior = mj.default_pose_prior()
    i = prior.joints.index(("LeftLowerLeg", "LeftUpperLeg"))
    deviation = np.degrees(np.sqrt(np.diag(prior.covariance)[3 * i : 3 * i + 3]))
    assert deviation[2] > 20 and deviation[:2].max() < 8
    bend = Rotation.from_quat(prior.mean[i], scalar_first=True).as_rotvec()
    assert -1.2 < bend[2] < -0.4


def test_a_file_comes_back(tmp_path):
    prior = mj.default_pose_prior()
    mj.save_pose_prior(tmp_path / "p.json", prior)
    other = mj.load_pose_prior(tmp_path / "p.json")
    assert other.joints == prior.joints and other.name == prior.name
    np.testing.assert_allclose(other.covariance, prior.covariance, rtol=1e-8)
    np.testing.assert_allclose(other.mean, prior.mean, rtol=1e-8)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"mean": [[1, 0, 0, 0]]}, "mean has shape"),
        ({"mean": [[2, 0, 0, 0], [1, 0, 0, 0]]}, "length 1"),
        ({"covariance": (-np.eye(6)).tolist()}, "not positive definite"),
        ({"covariance": np.triu(np.ones((6, 6))).tolist()}, "not symmetric"),
        ({"correlation_time": 0}, "must be > 0"),
        ({"joints": [["a", "b"], ["a", "b"]]}, "twice"),
        ({"joints": None}, "not a pose prior"),
        ({"mean": None}, "not a pose prior"),
    ],
)
def test_files_that_hold_no_prior(tmp_path, change: dict, told: str):
    good = {"joints": [["a", "b"], ["c", "a"]], "mean": [[1, 0, 0, 0]] * 2,
            "covariance": np.eye(6).tolist(), "correlation_time": 1.0}  # fmt: skip
    file = tmp_path / "p.json"
    file.write_text(json.dumps(good))
    assert isinstance(mj.load_pose_prior(file), PosePrior)
    file.write_text(json.dumps(good | change))
    with pytest.raises(InputError, match=told) as error:
        mj.load_pose_prior(file)
    assert str(file) in str(error.value) and "\n" not in str(error.value)


def test_missing_entries_and_files(tmp_path):
    file = tmp_path / "p.json"
    with pytest.raises(InputError, match="cannot read"):
        mj.load_pose_prior(file)
    file.write_text("{")
    with pytest.raises(InputError, match="not valid JSON"):
        mj.load_pose_prior(file)
    file.write_text("{}")
    with pytest.raises(InputError, match="'joints' is missing; needed are joints, mean"):
        mj.load_pose_prior(file)


def test_wrong_arguments_of_learning(body):
    with pytest.raises(InputError, match="no motions"):
        mj.learn_pose_prior({})
    with pytest.raises(InputError, match="valid: 0 to 1, above 0"):
        mj.learn_pose_prior({"a": swinging(body, 0, 60)}, floor=0.0)
    with pytest.raises(InputError, match="unknown segment 'Tail'"):
        mj.learn_pose_prior({"a": swinging(body, 0, 60)}, joints=(("Tail", "Pelvis"),))
    with pytest.raises(InputError, match="'Head' is no ancestor of 'Pelvis'"):
        mj.learn_pose_prior({"a": swinging(body, 0, 60)}, joints=(("Pelvis", "Head"),))
    with pytest.raises(InputError, match="LeftHand/LeftForeArm is there without RightHand/Right"):
        mj.learn_pose_prior({"a": swinging(body, 0, 60)}, joints=(("LeftHand", "LeftForeArm"),))


@pytest.mark.parametrize("rate", [23.0, 50.0, 75.0])
def test_what_is_learned_does_not_depend_on_the_rate(rate: float):
    """A walk at 30 Hz, and at rates that are no multiples of it."""
    walk = mj.builtin_motion("walking")
    path = walk.trajectory
    learned = []
    for hertz in (30.0, rate):
        near = np.searchsorted(path.time, np.arange(0, path.time[-1], 1 / hertz))
        thin = Motion("walk", walk.body, Trajectory(path.time[near], path.q[near]), {})
        learned.append(mj.learn_pose_prior({"walk": thin}, joints=LEGS[:2]))
    assert learned[1].correlation_time == pytest.approx(learned[0].correlation_time, rel=0.05)
    np.testing.assert_allclose(np.diag(learned[1].mobility), np.diag(learned[0].mobility), rtol=0.1)


@pytest.mark.parametrize("count", [1, 90])
def test_somebody_who_does_not_move(body, count: int):
    q = np.tile(body.qpos0, (count, 1))
    still = Motion("still", body, Trajectory(np.arange(count) / 30, q), {})
    prior = mj.learn_pose_prior({"still": still}, joints=LEGS[:2], floor=0.1)
    np.testing.assert_allclose(prior.covariance, 0.01 * np.eye(6), atol=1e-9)
    assert prior.correlation_time == pytest.approx(1 / 30)


def test_a_body_keeps_the_joints_that_its_tree_has(body):
    pairs = (("Head", "T8"), ("Pelvis", "Head"), ("Tail", "Pelvis"), ("LeftFoot", "LeftUpperLeg"))
    assert joints_of(body, pairs) == (pairs[0], pairs[3])


def test_mobility_of_a_walk_has_the_stated_floor():
    """Knees bend and do not twist: across their axis nothing moves."""
    prior = mj.learn_pose_prior({"walking": mj.builtin_motion("walking")})
    i = prior.joints.index(("LeftLowerLeg", "LeftUpperLeg"))
    rate = np.sqrt(np.diag(prior.mobility)[3 * i : 3 * i + 3])
    assert rate[2] > 5 * PACE_FLOOR
    np.testing.assert_allclose(rate[:2], PACE_FLOOR, rtol=0.5)
    assert np.linalg.eigvalsh(prior.mobility)[0] >= 0.99 * PACE_FLOOR**2


def test_a_prior_without_mobility_comes_back_without(tmp_path):
    import dataclasses

    prior = dataclasses.replace(mj.default_pose_prior(), mobility=None)
    mj.save_pose_prior(tmp_path / "p.json", prior)
    assert mj.load_pose_prior(tmp_path / "p.json").mobility is None
    assert prior.of_segments(["Pelvis", "LeftUpperLeg"]).mobility is None
