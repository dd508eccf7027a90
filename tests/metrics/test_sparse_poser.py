"""The Sparse Inertial Poser's metrics on poses that differ in a known way."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.metrics import sparse_poser_series
from mocap_jax.metrics.sparse_poser import MARKERS, VALIDATION_SEGMENTS
from mocap_jax.recording import Setup
from mocap_jax.solution import Status


@pytest.fixture(scope="module")
def body():
    return mj.human()


def standing(body, turned: dict[str, float] | None = None, shift: float = 0.0) -> mj.Solution:
    """Two frames of the reference pose with ball joints turned about X [rad]."""
    q = np.tile(np.asarray(body.qpos0), (2, 1))
    q[:, :3] += shift
    for name, angle in (turned or {}).items():
        at = body.topology.joint_qpos[body.topology.joint_index(name)]
        turn = Rotation.from_quat(q[0, at : at + 4], scalar_first=True)
        turn = turn * Rotation.from_rotvec([angle, 0, 0])
        q[:, at : at + 4] = turn.as_quat(scalar_first=True)
    path = mj.Trajectory(np.array([0.0, 1.0]), q)
    return mj.Solution(path, body, Status.CONVERGED, "made", Setup())


def test_a_turned_thigh(body):
    errors = mj.evaluate(standing(body, {"LeftUpperLeg": 0.2}, shift=0.5), standing(body)).errors
    angle = errors["validation_orientation_error_mean_deg"]
    assert angle["LeftUpperLeg"] == pytest.approx(np.rad2deg(0.2))
    assert angle["mean"] == pytest.approx(np.rad2deg(0.2) / len(VALIDATION_SEGMENTS))
    spread = errors["validation_orientation_error_std_deg"]
    assert spread["LeftUpperLeg"] == pytest.approx(0.0, abs=1e-9)
    assert spread["mean"] == pytest.approx(np.std([np.rad2deg(0.2), 0, 0, 0]))
    distance = errors["marker_position_error_mean_cm"]
    knee = 100 * 2 * np.sin(0.1) * mj.segment_lengths(body)["LeftUpperLeg"]
    assert distance["LeftLowerLeg"] == pytest.approx(knee, rel=1e-6)
    assert distance["LeftUpperLeg"] == pytest.approx(0.0, abs=1e-9)
    assert distance["mean"] == pytest.approx(
        (distance["LeftLowerLeg"] + distance["LeftFoot"]) / len(MARKERS)
    )


def test_bodies_of_other_sizes_are_compared_by_name(body):
    taller = dataclasses.replace(standing(mj.human(height=1.9)))
    errors = mj.evaluate(taller, standing(body)).errors
    assert errors["validation_orientation_error_mean_deg"]["mean"] == pytest.approx(0.0, abs=1e-6)
    assert 2 < errors["marker_position_error_mean_cm"]["mean"] < 12


def test_over_time_and_in_the_mean_they_agree(body):
    moved = standing(body, {"LeftUpperLeg": 0.2, "RightUpperArm": -0.1})
    series = sparse_poser_series(moved, standing(body))
    errors = mj.evaluate(moved, standing(body)).errors
    assert len(series.time) == len(series.orientation) == 2
    for values, key in (
        (series.orientation, "validation_orientation_error_mean_deg"),
        (series.position, "marker_position_error_mean_cm"),
    ):
        assert values.mean() == pytest.approx(errors[key]["mean"])


def test_different_skeletons_are_laid_over_each_other_by_the_hips(body):
    """One segment has another name, and the root is elsewhere: nothing is wrong."""
    xml = body.xml.replace('name="LeftToe"', 'name="toes"')
    other = mj.load_body(xml)
    assert other.topology.body_names != body.topology.body_names
    moved = standing(other)
    shifted = np.asarray(moved.trajectory.q).copy()
    shifted[:, :3] += [0.3, 0.1, 0.2]
    moved = dataclasses.replace(moved, trajectory=mj.Trajectory(moved.trajectory.time, shifted))
    errors = mj.evaluate(moved, standing(body)).errors
    assert errors["marker_position_error_mean_cm"]["mean"] == pytest.approx(0.0, abs=1e-9)
