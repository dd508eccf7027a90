"""Inertial readings against finite differences of positions and integrated rotations."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body
from mocap_jax.simulation import SimulationOptions, simulate
from mocap_jax.simulation.rest_hold import perform
from mocap_jax.simulation.rig import build_rig, inertial_readings


@pytest.fixture(scope="module")
def ideal(motion, suit):
    return simulate(motion, profile="ideal", suit=suit)


@pytest.fixture(scope="module")
def rig_and_spline(motion, suit, ideal):
    body = load_body(ideal.truth.body_xml)
    rig = build_rig(body, tuple(b.name for b in suit.boards), suit.source_sites)
    return rig, perform(motion, SimulationOptions()).spline(rig.topology)


def _site_path(rig, spline, time):
    """Positions and rotations of the boards by plain forward kinematics."""
    p, R = [], []
    for q in spline.pose(time):
        rig.data.qpos[:] = q
        mujoco.mj_kinematics(rig.model, rig.data)
        p.append(rig.data.site_xpos[rig.board_sites].copy())
        R.append(rig.data.site_xmat[rig.board_sites].reshape(-1, 3, 3).copy())
    return np.array(p), np.array(R)


def test_rest_reads_gravity_upwards(ideal):
    rest = ideal.setup.rest
    for name, stream in ideal.inertial.items():
        still = stream.time < rest.end
        mean = stream.accelerometer[still].mean(axis=0)
        assert np.linalg.norm(mean) == pytest.approx(9.81, abs=1e-4), name
        assert np.abs(stream.gyroscope[still]).max() < 1e-5
    # The base's board has its z axis along -y of the base and its y axis up.
    up = ideal.inertial["base"].accelerometer[:100].mean(axis=0)
    np.testing.assert_allclose(up, [0, 9.81, 0], atol=1e-3)


def test_accelerometer_is_second_difference_of_position(rig_and_spline):
    rig, spline = rig_and_spline
    time = np.linspace(2.2, spline.end - 0.1, 60)
    h = 1e-4
    p0, R = _site_path(rig, spline, time)
    p1, p2 = _site_path(rig, spline, time - h)[0], _site_path(rig, spline, time + h)[0]
    acceleration = (p1 - 2 * p0 + p2) / h**2
    expected = np.einsum("tbji,tbj->tbi", R, acceleration + [0, 0, 9.81])
    readings = inertial_readings(rig, spline, time)[:, :, :3]
    np.testing.assert_allclose(readings, expected, atol=5e-4)


def test_samples_are_means_over_their_interval(ideal, rig_and_spline):
    rig, spline = rig_and_spline
    step = 1 / 140
    k = 620
    time = float(ideal.inertial["lower"].time[k])
    fine = time + step * ((np.arange(400) + 0.5) / 400 - 0.5)
    mean = inertial_readings(rig, spline, fine).mean(axis=0)
    for i, stream in enumerate(ideal.inertial.values()):
        np.testing.assert_allclose(stream.accelerometer[k], mean[i, :3], atol=1e-4)
        np.testing.assert_allclose(stream.gyroscope[k], mean[i, 3:], atol=1e-5)


def test_gyroscope_integrates_to_the_rotation(ideal, rig_and_spline):
    rig, spline = rig_and_spline
    time = np.asarray(ideal.inertial["lower"].time)
    _, R = _site_path(rig, spline, np.array([time[0] - 0.5 / 140, time[-1] + 0.5 / 140]))
    for i, stream in enumerate(ideal.inertial.values()):
        # Means over intervals give the turn of each up to coning, added to third order.
        turn = np.asarray(stream.gyroscope) / 140
        coning = np.zeros_like(turn)
        coning[1:-1] = np.cross(turn[:-2], turn[1:-1])
        coning[1:-1] = (np.cross(turn[:-2], turn[1:-1]) + np.cross(turn[1:-1], turn[2:])) / 24
        total = Rotation.identity()
        for step in Rotation.from_rotvec(turn + coning):
            total = total * step
        error = Rotation.from_matrix(R[0, i].T @ R[1, i]).inv() * total
        assert np.degrees(error.magnitude()) < 0.005


def test_truth_is_the_splined_motion(ideal, rig_and_spline):
    _, spline = rig_and_spline
    truth = ideal.truth.trajectory
    q, v, _ = spline.evaluate(np.asarray(truth.time))
    np.testing.assert_allclose(np.asarray(truth.q), q, atol=1e-12)
    np.testing.assert_allclose(np.asarray(truth.v), v, atol=1e-9)
    np.testing.assert_allclose(truth.time, ideal.inertial["upper"].time)


def test_paper_noise_is_as_stated(motion, suit, ideal):
    paper = simulate(motion, profile="paper", suit=suit)
    figures = paper.setup.noise
    force = np.concatenate(
        [paper.inertial[n].accelerometer - ideal.inertial[n].accelerometer for n in ideal.inertial]
    )
    rate = np.concatenate(
        [paper.inertial[n].gyroscope - ideal.inertial[n].gyroscope for n in ideal.inertial]
    )
    assert force.std() == pytest.approx(figures.accelerometer, rel=0.03)
    assert rate.std() == pytest.approx(figures.gyroscope, rel=0.03)
    lag = (force[1:] * force[:-1]).mean() / force.var()
    assert abs(lag) < 0.05
    root = np.asarray(paper.root.position) - np.asarray(ideal.root.position)
    assert root.std() == pytest.approx(figures.root_position, rel=0.05)


def test_seeds_reproduce_and_differ(motion, suit):
    first, second, other = (simulate(motion, profile="field", suit=suit, seed=s) for s in (3, 3, 4))
    for name in first.inertial:
        np.testing.assert_array_equal(
            first.inertial[name].accelerometer, second.inertial[name].accelerometer
        )
    np.testing.assert_array_equal(first.ranges.distance, second.ranges.distance)
    assert first.truth.body_xml == second.truth.body_xml != other.truth.body_xml
