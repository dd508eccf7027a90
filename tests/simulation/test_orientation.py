"""Orientations that boards report: where they point, and how they err."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body, site_frames
from mocap_jax.simulation import PROFILES, SimulationOptions, simulate

ON = SimulationOptions(orientations=True)


def errors(recording, board: str) -> np.ndarray:
    """Rotation vectors in the world from the true board (without soft tissue) to the reported."""
    body = load_body(recording.truth.body_xml)
    stream, truth = recording.inertial[board], recording.truth
    offset = float(truth.parameters[f"clock_offset/{board}"])
    at = np.searchsorted(truth.trajectory.time, np.asarray(stream.time) - offset - 1e-6)
    site = body.site_index(board)
    true = [site_frames(body, q).rotation[site] for q in np.asarray(truth.trajectory.q)[at[::40]]]
    measured = Rotation.from_quat(np.asarray(stream.orientation)[::40], scalar_first=True)
    return (measured * Rotation.from_matrix(np.array(true)).inv()).as_rotvec()


def test_ideal_orientations_are_the_boards_own(motion, suit):
    recording = simulate(motion, profile="ideal", suit=suit, options=ON)
    for board in recording.inertial:
        np.testing.assert_allclose(errors(recording, board), 0.0, atol=1e-9)


def test_gravity_points_up_at_rest(motion, suit):
    recording = simulate(motion, profile="paper", suit=suit, options=ON)
    for stream in recording.inertial.values():
        still = np.asarray(stream.time) < 1.5
        turn = Rotation.from_quat(np.asarray(stream.orientation)[still], scalar_first=True)
        mean = turn.apply(np.asarray(stream.accelerometer)[still]).mean(0)
        np.testing.assert_allclose(mean, [0, 0, 9.81], atol=0.05)


def test_white_noise_is_the_stated_one(motion, suit):
    recording = simulate(motion, profile="paper", suit=suit, options=ON)
    found = np.concatenate([errors(recording, b) for b in recording.inertial])
    assert found.std() == pytest.approx(recording.setup.noise.orientation, rel=0.2)


def test_slow_errors_are_told_and_have_the_profile_s_size(motion, suit):
    told = []
    for seed in range(8):
        recording = simulate(motion, profile="field", suit=suit, seed=seed, options=ON)
        told += [
            np.asarray(recording.truth.parameters[f"orientation_error/{b}"])
            for b in recording.inertial
        ]
    start = np.array([t[0] for t in told])
    field = PROFILES["field"]
    assert start[:, 2].std() == pytest.approx(field.orientation_heading, rel=0.4)
    assert start[:, :2].std() == pytest.approx(field.orientation_tilt, rel=0.4)
    steps = np.concatenate([np.diff(t, axis=0) for t in told])
    # Of a Gauss-Markov process: sigma sqrt(2 h / tau) a step of h.
    expected = field.orientation_heading * np.sqrt(2 / 140 / field.orientation_time)
    assert steps[:, 2].std() == pytest.approx(expected, rel=0.05)


def test_other_readings_do_not_depend_on_them(motion, suit):
    with_them = simulate(motion, profile="field", suit=suit, seed=3, options=ON)
    without = simulate(motion, profile="field", suit=suit, seed=3)
    for name, stream in without.inertial.items():
        np.testing.assert_array_equal(stream.gyroscope, with_them.inertial[name].gyroscope)
        np.testing.assert_array_equal(stream.time, with_them.inertial[name].time)
        assert np.isnan(np.asarray(stream.orientation)).all()
        assert np.isfinite(np.asarray(with_them.inertial[name].orientation)).all()
