"""Splined motion: rates against finite differences by C MuJoCo, and a smooth seam."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.simulation import SimulationOptions
from mocap_jax.simulation.rest_hold import perform
from mocap_jax.simulation.smoothing import bridge_jumps, low_pass
from mocap_jax.simulation.spline import PoseSpline


@pytest.fixture(scope="module")
def performance(motion):
    return perform(motion, SimulationOptions())


def _difference(model, q_from, q_to, step):
    out = np.zeros(model.nv)
    mujoco.mj_differentiatePos(model, out, step, q_from, q_to)
    return out


def test_velocity_and_acceleration_are_derivatives_of_the_pose(motion, performance):
    model = motion.body.mujoco_model()
    spline = performance.spline(motion.body.topology)
    h = 1e-4
    time = np.linspace(spline.start + 0.5, spline.end - 0.5, 40)
    _, v, a = spline.evaluate(time)
    before, after = spline.pose(time - h), spline.pose(time + h)
    for i in range(len(time)):
        np.testing.assert_allclose(_difference(model, before[i], after[i], 2 * h), v[i], atol=2e-5)
    # Body-frame angular velocity differentiates to body-frame angular acceleration.
    _, v_before, _ = spline.evaluate(time - h)
    _, v_after, _ = spline.evaluate(time + h)
    np.testing.assert_allclose((v_after - v_before) / (2 * h), a, atol=1e-4)


def test_blend_joins_pose_velocity_and_acceleration(motion, performance):
    spline = performance.spline(motion.body.topology)
    step = performance.time[1]
    time = np.arange(performance.rest.end, spline.end, step)
    _, v, a = spline.evaluate(time)
    assert np.abs(np.diff(a, axis=0)).max() < 0.4 * np.abs(a).max()
    seam = np.abs(time - performance.score_from) < 0.05
    assert np.abs(np.diff(v[seam], axis=0)).max() < 2 * step * np.abs(a[seam]).max() + 1e-6


def test_rest_hold_is_still_in_the_declared_pose(motion, performance):
    spline = performance.spline(motion.body.topology)
    q, v, a = spline.evaluate(np.linspace(0.0, performance.rest.end, 50))
    assert np.abs(v).max() < 1e-5
    assert np.abs(a).max() < 1e-3
    names = motion.body.topology.joint_names
    declared = np.concatenate([performance.rest.pose[n] for n in names])
    np.testing.assert_allclose(q[0], declared, atol=1e-12)


def test_low_pass_keeps_slow_motion_and_removes_jitter(motion):
    topology, q = motion.body.topology, np.asarray(motion.trajectory.q)
    kept, cutoff = low_pass(topology, q, 120.0, 12.0)
    assert cutoff == 12.0
    assert np.abs(kept - q)[30:-30].max() < 1e-3
    jitter = np.random.default_rng(0).standard_normal(len(q)) * 0.01
    noisy = q.copy()
    noisy[:, 11] += jitter
    left = low_pass(topology, noisy, 120.0, 12.0)[0][:, 11] - kept[:, 11]
    # A white spectrum cut at 12 of 60 Hz keeps a fifth of its power.
    assert 0.3 < left.std() / jitter.std() < 0.6


def test_half_power_frequency_is_the_one_asked_for(motion):
    topology = motion.body.topology
    t = np.arange(0, 10, 1 / 120)
    q = np.tile(np.asarray(motion.body.qpos0), (len(t), 1))
    q[:, 11] = np.sin(2 * np.pi * 12.0 * t)
    out, _ = low_pass(topology, q, 120.0, 12.0)
    gain = out[300:-300, 11].std() / q[300:-300, 11].std()
    assert gain == pytest.approx(np.sqrt(0.5), abs=1e-3)


def test_whole_turns_pass_the_filter(motion):
    topology = motion.body.topology
    t = np.arange(0, 6, 1 / 120)
    q = np.tile(np.asarray(motion.body.qpos0), (len(t), 1))
    angle = 2 * np.pi * t
    q[:, 3], q[:, 6] = np.cos(angle / 2), np.sin(angle / 2)
    flipped = q.copy()
    flipped[::3, 3:7] *= -1
    out, _ = low_pass(topology, flipped, 120.0, 12.0)
    inner = slice(60, -60)
    assert np.abs((out[inner, 3:7] * q[inner, 3:7]).sum(axis=1)).min() > 1 - 1e-6


def test_impossible_jumps_are_bridged(motion):
    topology, q = motion.body.topology, np.asarray(motion.trajectory.q).copy()
    clean, none = bridge_jumps(topology, q, 120.0, 40.0)
    assert none == 0
    np.testing.assert_allclose(clean, q, atol=1e-12)
    q[200:202, 11] += 2.5
    repaired, count = bridge_jumps(topology, q, 120.0, 40.0)
    assert 10 < count < 40
    assert np.abs(np.diff(repaired[:, 11])).max() * 120 < 40


def test_two_flips_are_bridged_without_a_turn(motion):
    topology, q = motion.body.topology, np.asarray(motion.trajectory.q).copy()
    flipped = q.copy()
    flipped[200:208, 11] += np.pi - 0.05
    flipped[208:, 11] += 2 * np.pi - 0.05
    repaired, _ = bridge_jumps(topology, flipped, 120.0, 40.0)
    np.testing.assert_allclose(repaired[:150, 11], q[:150, 11])
    np.testing.assert_allclose(repaired[260:, 11], q[260:, 11] - 0.05, atol=1e-9)


def test_wrong_motions_are_refused_by_name(motion):
    from dataclasses import replace

    from mocap_jax.trajectory import Trajectory

    time, q = np.asarray(motion.trajectory.time), np.asarray(motion.trajectory.q)
    bad = q.copy()
    bad[3, 2] = np.nan
    for trajectory, word in (
        (Trajectory(time[:4], q[:4]), "frames"),
        (Trajectory(time, bad), "finite"),
        (Trajectory(time**2, q), "uniform"),
    ):
        with pytest.raises(InputError, match=word):
            perform(replace(motion, trajectory=trajectory), SimulationOptions())
    with pytest.raises(InputError, match="cutoff_hz"):
        SimulationOptions(cutoff_hz=-1)


def test_spline_reaches_its_knots(motion):
    time, q = np.asarray(motion.trajectory.time), np.asarray(motion.trajectory.q)
    spline = PoseSpline(motion.body.topology, time, q)
    np.testing.assert_allclose(spline.pose(time), q, atol=1e-12)
