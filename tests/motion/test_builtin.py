"""Built-in motions: smooth, within limits, at human speed, every joint used."""

from __future__ import annotations

from pathlib import Path

import jax
import mujoco
import numpy as np
import pytest

from mocap_jax.body import Body, difference, load_body
from mocap_jax.errors import InputError
from mocap_jax.motion import BUILTIN_MOTIONS, Motion, body_from_asf, builtin_motion, human


def velocities(motion: Motion) -> np.ndarray:
    """Tangent velocities by first differences [rad/s, m/s]."""
    topology, q = motion.body.topology, motion.trajectory.q
    step = jax.jit(jax.vmap(lambda a, b: difference(topology, a, b)))
    return np.asarray(step(q[:-1], q[1:])) / np.diff(np.asarray(motion.trajectory.time))[:, None]


def check_limits(motion: Motion) -> None:
    body, q = motion.body, np.asarray(motion.trajectory.q)
    for j, kind in enumerate(body.topology.joint_types):
        start, (lower, upper) = body.topology.joint_qpos[j], np.asarray(body.joint_range[j])
        if kind == "hinge":
            rest = float(body.qpos0[start])  # some bodies rest outside their limits
            values = q[:, start]
        elif kind == "ball":
            values, rest = 2 * np.arccos(np.clip(np.abs(q[:, start]), 0, 1)), 0.0
        else:
            continue
        assert values.min() >= min(lower, rest) - 1e-9, body.topology.joint_names[j]
        assert values.max() <= max(upper, rest) + 1e-9, body.topology.joint_names[j]


@pytest.fixture(params=["human", "asf", "humanoid_cmu"])
def body(request: pytest.FixtureRequest) -> Body:
    if request.param == "human":
        return human()
    data: Path = request.getfixturevalue("shared_data")
    if request.param == "asf":
        return body_from_asf(data / "cmu_mocap" / "02.asf")
    return load_body(data / "mjcf_humanoid_cmu" / "humanoid_CMU_V2020.xml", free_root=True)


def test_routine_moves_every_joint_smoothly_from_rest_to_rest(body: Body) -> None:
    motion = builtin_motion("routine", body)
    q, time = np.asarray(motion.trajectory.q), np.asarray(motion.trajectory.time)
    assert time[-1] == pytest.approx(30.0)
    for frame in (0, -1):
        np.testing.assert_allclose(q[frame], np.asarray(body.qpos0), atol=1e-12)
    v = velocities(motion)
    assert np.abs(v).max() < 6.0
    assert (np.abs(v).max(axis=0) > 0.02).all()
    assert np.abs(np.diff(v, axis=0)).max() < 0.3  # [rad/s] a frame: 36 rad/s^2
    assert np.abs(v[[0, -1]]).max() < 1e-6
    check_limits(motion)


def test_walking_keeps_its_speed_and_its_feet_on_the_floor() -> None:
    motion = builtin_motion("walking")
    q, time = np.asarray(motion.trajectory.q), np.asarray(motion.trajectory.time)
    assert (q[-1, 0] - q[0, 0]) / time[-1] == pytest.approx(1.3, rel=1e-6)
    v = velocities(motion)
    assert np.abs(v).max() < 8.0
    assert np.abs(np.diff(v, axis=0)).max() < 1.2
    check_limits(motion)
    model = motion.body.mujoco_model()
    data = mujoco.MjData(model)
    toe = []
    for pose in q[:132]:
        data.qpos = pose
        mujoco.mj_kinematics(model, data)
        reach = model.geom_size[:, 0] + model.geom_size[:, 1] * np.abs(data.geom_xmat[:, 8])
        assert abs((data.geom_xpos[:, 2] - reach).min()) < 0.01
        toe.append(data.body("RightToe").xpos.copy())
    stance = np.array(toe)[15:65]  # 12 to 50 % of the stride
    assert np.ptp(stance[:, 0]) < 0.06  # averaged curves of many people slide a little
    assert np.ptp(np.array(toe)[:, 0]) > 1.2


def test_unknown_names_and_bodies_are_refused(shared_data: Path) -> None:
    assert BUILTIN_MOTIONS == ("routine", "walking")
    with pytest.raises(InputError, match="unknown built-in motion 'run'; valid: routine, walking"):
        builtin_motion("run")
    with pytest.raises(InputError, match="walking is for the body of human"):
        builtin_motion("walking", body_from_asf(shared_data / "cmu_mocap" / "02.asf"))
