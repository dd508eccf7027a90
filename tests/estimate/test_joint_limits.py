"""Limits of ball joints: nothing inside, exact derivatives outside, learned from both sides."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax import so3
from mocap_jax.errors import InputError
from mocap_jax.estimate import check_residual
from mocap_jax.motion import Motion
from mocap_jax.pose_prior import anatomical_joint_rotations
from mocap_jax.pose_prior.rotations import rotation_vectors

TIME = np.arange(50) / 50.0


@pytest.fixture(scope="module")
def walking() -> Motion:
    return mj.builtin_motion("walking")


@pytest.fixture(scope="module")
def prior(walking: Motion) -> mj.PosePrior:
    return mj.learn_pose_prior({"walking": walking})


@pytest.fixture(scope="module")
def body(walking: Motion) -> mj.Body:
    return mj.ball_jointed(walking.body)


def vectors(limits: mj.JointLimits, body: mj.Body, q: np.ndarray) -> np.ndarray:
    mean = Rotation.from_quat(limits.mean, scalar_first=True).as_matrix()
    rotation = anatomical_joint_rotations(body, q, limits.joints)
    return rotation_vectors(mean, rotation).reshape(len(q), -1, 3)


def test_learned_limits_hold_all_poses_and_their_mirror_images(walking, prior) -> None:
    limits = mj.learn_joint_limits({"walking": walking}, prior, share=0.0, margin=0.01)
    x = vectors(limits, walking.body, np.asarray(walking.trajectory.q)[::4])
    assert (x > limits.lower).all() and (x < limits.upper).all()
    names = [child for child, _ in limits.joints]
    left, right = names.index("LeftUpperArm"), names.index("RightUpperArm")
    # Reflection turns rotations about forward and up around, those about right are kept.
    np.testing.assert_allclose(limits.lower[left][:2], -limits.upper[right][:2], atol=1e-6)
    np.testing.assert_allclose(limits.lower[left][2], limits.lower[right][2], atol=1e-6)
    tight = mj.learn_joint_limits({"walking": walking}, prior, share=0.1, margin=0.0)
    assert (tight.upper <= limits.upper).all() and (tight.lower >= limits.lower).all()


def test_inside_nothing_outside_the_amount_and_exact_derivatives(prior, body) -> None:
    n = len(prior.joints)
    wide = mj.JointLimits(prior.joints, prior.mean, np.full((n, 3), -1.5), np.full((n, 3), 1.5))
    residual, rows = mj.joint_limits(wide, body, TIME, sigma=0.05)
    row = {name: values[0] for name, values in rows.items()}
    q = np.asarray(body.qpos0)[None].copy()
    assert np.abs(residual.function(body, jnp.asarray(q), row)).max() < 1e-6

    arm = body.topology.joint_names.index("LeftForeArm")
    at = body.topology.joint_qpos[arm]
    turn = so3.quat_exp(jnp.array([0.2, 0.1, -2.2]))
    q[0, at : at + 4] = np.asarray(turn)
    x = vectors(wide, body, q)[0]
    beyond = np.maximum(x - 1.5, 0) + np.minimum(x + 1.5, 0)
    assert np.abs(beyond).max() > 0.3
    got = np.asarray(residual.function(body, jnp.asarray(q), row)).reshape(n, 3)
    np.testing.assert_allclose(got * 0.05 / np.sqrt(0.02), beyond, atol=1e-3)
    report = check_residual(residual, body, q, row)
    assert report.ok, str(report)


def test_joints_that_a_body_lacks_are_left_out(prior, body) -> None:
    n = len(prior.joints)
    limits = mj.JointLimits(prior.joints, prior.mean, np.full((n, 3), -1), np.full((n, 3), 1))
    renamed = body.xml.replace('"LeftHand"', '"Glove"')
    _, rows = mj.joint_limits(limits, mj.load_body(renamed), TIME)
    assert rows["lower"].shape == (50, n - 1, 3)
    foreign = mj.load_body(
        '<mujoco><worldbody><body name="a"><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    )
    with pytest.raises(InputError, match="none of their joints is in this body, .* a$"):
        mj.joint_limits(limits, foreign, TIME)
    with pytest.raises(InputError, match="sigma and softness"):
        mj.joint_limits(limits, body, TIME, sigma=0.0)
    with pytest.raises(InputError, match=r"joint limits: time has shape \(1,\); .* two frames"):
        mj.joint_limits(limits, body, TIME[:1])
    with pytest.raises(InputError, match="limits of L5 in Pelvis: lower is above upper"):
        dataclasses.replace(limits, lower=limits.upper + 1)
    with pytest.raises(InputError, match=r"upper has shape \(2, 3\)"):
        dataclasses.replace(limits, upper=np.zeros((2, 3)))


def test_nothing_is_learned_from_nothing(prior, walking) -> None:
    with pytest.raises(InputError, match="no motions"):
        mj.learn_joint_limits({}, prior)
    with pytest.raises(InputError, match=r"share 0\.7"):
        mj.learn_joint_limits({"walking": walking}, prior, share=0.7)
