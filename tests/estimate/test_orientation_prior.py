"""The pose prior in the orientation pass."""

from __future__ import annotations

import dataclasses
import pickle

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.body import frames, retract
from mocap_jax.errors import InputError
from mocap_jax.estimate.orientation_prior import frame_prior
from mocap_jax.pose_prior import anatomical_joint_rotations
from mocap_jax.recording import InertialStream, Recording, RootStream, SensorSpec, Setup
from mocap_jax.simulation import mount, named_suit
from mocap_jax.simulation.mounting import with_shapes


@pytest.fixture(scope="module")
def body():
    human = with_shapes(mj.human())
    return mount(human, named_suit("sip6_head", human))


def test_derivatives_against_autodiff(body):
    prior = frame_prior(body, mj.default_pose_prior(), 0.05, 0.1)
    rng = np.random.default_rng(0)
    q = retract(body.topology, body.qpos0, jnp.asarray(0.3 * rng.normal(size=body.nv)))

    @jax.jit
    def residual(delta):
        moved = retract(body.topology, q, delta)
        return prior.linearised(body, frames(body, moved))[0]

    zero = jnp.zeros(body.nv)
    value, slopes = prior.linearised(body, frames(body, q))
    np.testing.assert_allclose(value, residual(zero), atol=1e-12)
    np.testing.assert_allclose(slopes, jax.jit(jax.jacfwd(residual))(zero), atol=1e-9)


def test_residual_is_the_mahalanobis_distance(body):
    """Without the joints that share, whose distance comes on top."""
    prior = mj.default_pose_prior()
    own = prior.of_segments(body.topology.body_names)
    rng = np.random.default_rng(1)
    q = np.asarray(retract(body.topology, body.qpos0, jnp.asarray(0.3 * rng.normal(size=body.nv))))
    found, _ = frame_prior(body, prior, 1.0, 0.1).linearised(body, frames(body, q))
    expected = own.mahalanobis(anatomical_joint_rotations(body, q[None], own.joints))[0]
    assert (np.asarray(found)[: 3 * len(own.joints)] ** 2).sum() == pytest.approx(expected)


def test_what_no_sensor_tells_follows_the_prior(body):
    """A pose as the prior's mean is found from six orientations; without the prior it is not."""
    reference = np.asarray(body.qpos0)
    prior = mj.default_pose_prior()
    quiet = mj.OrientationPassOptions(pose_prior=prior, warm_start=True)
    recording = _standing(body, reference)
    with_prior = mj.orientation_pass(recording, body, options=quiet)
    own = prior.of_segments(body.topology.body_names)
    rotation = anatomical_joint_rotations(body, np.asarray(with_prior.trajectory.q)[:1], own.joints)
    at_start = anatomical_joint_rotations(body, reference[None], own.joints)
    assert own.mahalanobis(rotation)[0] < 0.5 * own.mahalanobis(at_start)[0]
    for statistics in with_prior.statistics.values():
        assert statistics["rms_units"] < 0.05


def _standing(body, q) -> Recording:
    """Four samples of the sensors' orientations in one pose."""
    from mocap_jax.body import site_frames
    from mocap_jax.so3 import quat_from_matrix

    turned = site_frames(body, q).rotation
    time, nothing = 0.1 * np.arange(4), np.full((4, 3), np.nan)
    streams = {
        name: InertialStream(
            time, nothing, nothing,
            np.tile(np.asarray(quat_from_matrix(turned[body.site_index(name)])), (4, 1)),
        )
        for name in body.topology.site_names
    }  # fmt: skip
    setup = Setup(sensors=tuple(SensorSpec(n, n, 10.0) for n in streams))
    return Recording(streams, None, None, {}, None, None, setup, body.xml)


def test_wrong_figures_are_refused(body):
    wrong = mj.OrientationPassOptions(orientation_sigma=0.0)
    with pytest.raises(InputError, match="orientation_sigma"):
        mj.orientation_pass(_standing(body, np.asarray(body.qpos0)), body, options=wrong)
    assert dataclasses.replace(wrong, orientation_sigma=0.1).share_sigma > 0


def test_equal_priors_are_one_program(body):
    one, other = (frame_prior(body, mj.default_pose_prior(), 0.05, 0.1) for _ in range(2))
    assert one == other and hash(one) == hash(other) and one is not other
    assert one != frame_prior(body, mj.default_pose_prior(), 0.06, 0.1)
    before = pickle.dumps(frame_prior(body, mj.default_pose_prior(), 0.05, 0.1))
    assert pickle.dumps(one) == before  # keys of programs do not tell whether it was hashed


def test_a_prior_of_other_segments_is_refused(body):
    prior = mj.PosePrior((("tibia_r", "femur_r"),), np.eye(4)[:1], np.eye(3), 1.0, name="OpenSim")
    with pytest.raises(InputError, match="'OpenSim': none of its joints .* Pelvis, .* or None"):
        frame_prior(body, prior, 0.05, 0.1)


def test_a_free_root_stays_at_the_start(body):
    """Where the recording says the root is, only `root` "given" may use."""
    recording = _standing(body, np.asarray(body.qpos0))
    root = RootStream(
        0.1 * np.arange(4), np.tile([5.0, 6.0, 7.0], (4, 1)), np.tile([1.0, 0, 0, 0], (4, 1))
    )
    measured = dataclasses.replace(recording, root=root)
    place = {
        how: np.asarray(mj.orientation_pass(
            measured, body, options=mj.OrientationPassOptions(warm_start=True, root=how)
        ).trajectory.q)[:, :3]
        for how in ("given", "free")
    }  # fmt: skip
    np.testing.assert_allclose(place["given"], np.tile([5.0, 6.0, 7.0], (4, 1)))
    np.testing.assert_array_equal(place["free"], np.tile(body.qpos0[:3], (4, 1)))
    for wrong, told in (("fixed", "valid: auto, given, free"), ("given", "no measured root")):
        with pytest.raises(InputError, match=told):
            mj.orientation_pass(
                recording, body, options=mj.OrientationPassOptions(root=wrong, warm_start=True)
            )
