"""Kinematics against C MuJoCo on 1000 random states of four bodies.

Positions, rotations, Jacobians, velocities and accelerations agree to 1e-10, relative where the
values exceed one (measured: below 1e-12). Print the worst errors with `pytest -s`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from sample_bodies import SAMPLES, random_states, sample_body, worst

from mocap_jax.body import Body, frames, load_body, site_frames, site_jacobians, site_motion
from mocap_jax.errors import InputError

STATES = 1000
TOLERANCE = 1e-10


class Compared(NamedTuple):
    """One body's results: ours and C MuJoCo's under the same names."""

    body: Body
    ours: dict[str, np.ndarray]
    reference: dict[str, np.ndarray]


def chosen_sites(body: Body) -> np.ndarray:
    """At most eight sites, for Jacobians."""
    count = len(body.topology.site_names)
    return np.unique(np.linspace(0, count - 1, 8).astype(int))


def our_results(body: Body, q, v, a) -> dict[str, np.ndarray]:
    def one(q, v, a):
        f = frames(body, q)
        motion = site_motion(body, q, v, a)
        linear, angular = site_jacobians(body, f, motion.position, chosen_sites(body))
        return {
            "body position": f.position,
            "body rotation": f.rotation,
            "site position": motion.position,
            "site rotation": motion.rotation,
            "site angular velocity": motion.angular_velocity,
            "site velocity": motion.velocity,
            "site angular acceleration": motion.angular_acceleration,
            "site acceleration": motion.acceleration,
            "Jacobian of position": linear,
            "Jacobian of rotation": angular,
        }

    return jax.tree.map(np.asarray, jax.jit(jax.vmap(one))(q, v, a))


def mujoco_state(model, data, sites: np.ndarray) -> dict[str, np.ndarray]:
    """Reference values at the state in `data`, whose position, velocity and qacc are set."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    mujoco.mj_rnePostConstraint(model, data)
    twist, acceleration = np.zeros((2, model.nsite, 6))
    for site in range(model.nsite):
        at = (model, data, mujoco.mjtObj.mjOBJ_SITE, site)
        mujoco.mj_objectVelocity(*at, twist[site], 0)
        mujoco.mj_objectAcceleration(*at, acceleration[site], 0)
    linear, angular = np.zeros((2, sites.size, 3, model.nv))
    for row, site in enumerate(sites):
        mujoco.mj_jacSite(model, data, linear[row], angular[row], site)
    return {
        "body position": data.xpos.copy(),
        "body rotation": data.xmat.reshape(-1, 3, 3).copy(),
        "site position": data.site_xpos.copy(),
        "site rotation": data.site_xmat.reshape(-1, 3, 3).copy(),
        "site angular velocity": twist[:, :3],
        "site velocity": twist[:, 3:],
        "site angular acceleration": acceleration[:, :3],
        # MuJoCo reports what an accelerometer feels: the acceleration less gravity.
        "site acceleration": acceleration[:, 3:] + model.opt.gravity,
        "Jacobian of position": linear.swapaxes(1, 2),
        "Jacobian of rotation": angular.swapaxes(1, 2),
    }


def mujoco_results(body: Body, q, v, a) -> dict[str, np.ndarray]:
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    states = []
    for data.qpos, data.qvel, data.qacc in zip(q, v, a, strict=True):
        states.append(mujoco_state(model, data, chosen_sites(body)))
    return {key: np.stack([s[key] for s in states]) for key in states[0]}


@pytest.fixture(scope="module", params=SAMPLES)
def compared(request) -> Compared:
    from_files = request.param in ("cmu_asf", "dm_control_humanoid")
    body = sample_body(
        request.param, request.getfixturevalue("shared_data") if from_files else None
    )
    state = random_states(body, STATES)
    result = Compared(body, our_results(body, *state), mujoco_results(body, *state))
    errors = {key: worst(result.ours[key], result.reference[key]) for key in result.ours}
    print(f"\n{request.param}: nv {body.nv}, worst of {STATES} states:",
          ", ".join(f"{key} {error:.1e}" for key, error in errors.items()))  # fmt: skip
    return result


@pytest.mark.parametrize("quantity", [
    "body position", "body rotation", "site position", "site rotation", "site velocity",
    "site angular velocity", "site acceleration", "site angular acceleration",
    "Jacobian of position", "Jacobian of rotation",
])  # fmt: skip
def test_agrees_with_mujoco(compared: Compared, quantity: str) -> None:
    assert compared.ours[quantity].shape == compared.reference[quantity].shape
    assert worst(compared.ours[quantity], compared.reference[quantity]) < TOLERANCE


def test_samples_cover_every_joint_and_tree() -> None:
    topology = sample_body("mixed").topology
    assert set(topology.joint_types) == {"free", "ball", "hinge", "slide"}
    joints = [len(topology.joints_of_body(b)) for b in range(1, topology.nbody)]
    assert {0, 1, 4} <= set(joints)


def test_scale_of_quaternions_does_not_matter() -> None:
    body = sample_body("mixed")
    q = random_states(body, 1)[0][0]
    scaled = q.copy()
    scaled[body.topology.quat_index[0].ravel()] *= -1.7
    pose = jax.jit(lambda q: frames(body, q))
    for ours, same in zip(pose(scaled), pose(q), strict=True):
        np.testing.assert_allclose(ours, same, atol=1e-13)


def test_single_precision_stays_single() -> None:
    body = sample_body("mixed")
    single = jax.tree.map(lambda x: x.astype(jnp.float32), body)
    q = random_states(body, 1)[0][0]
    result = site_frames(single, jnp.asarray(q, jnp.float32))
    assert result.position.dtype == result.rotation.dtype == jnp.float32
    np.testing.assert_allclose(result.position, site_frames(body, q).position, atol=1e-5)


def test_only_welded_sites_on_the_world_stand_still() -> None:
    body = sample_body("mixed")
    q, v, a = (x[0] for x in random_states(body, 1))
    motion = site_motion(body, q, v, a)
    fixed = body.site_index("fixed")
    np.testing.assert_array_equal(motion.velocity[fixed], 0.0)
    np.testing.assert_allclose(motion.position[fixed], [1, 2, 3], atol=1e-15)


def test_body_of_one_joint_and_unknown_site() -> None:
    link = "<body><joint type='ball'/><geom size='1'/></body>"
    body = load_body(f"<mujoco><worldbody>{link}</worldbody></mujoco>")
    f = frames(body, jnp.array([0.0, 1.0, 0.0, 0.0]))
    np.testing.assert_allclose(f.rotation[1], np.diag([1.0, -1, -1]), atol=1e-15)
    assert f.angular.shape == f.linear.shape == (3, 3)
    with pytest.raises(InputError, match="unknown site 'hand'"):
        body.site_index("hand")
