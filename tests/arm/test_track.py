"""The three trackers on one short simulated trial (C MuJoCo), and what they cannot know."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest

from mocap_jax.arm import anchor_ranges, joint_filter, optimised, paper_tracker
from mocap_jax.arm.errors import arm_points, true_points
from mocap_jax.arm.mirror import bent_forward
from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.recording import Recording
from mocap_jax.simulation.arm import ArmScene, declared, simulate_arm
from mocap_jax.simulation.arm_movement import ArmMovement

CLEAN = ArmScene(
    movement=ArmMovement(seconds=4.0, elbow_deg=(30.0, 110.0), out_of_plane_deg=0.0, vibration=0.0)
)


@pytest.fixture(scope="module")
def trial() -> Recording:
    return simulate_arm(CLEAN, seed=1)


@pytest.fixture(scope="module")
def smoothed(trial: Recording):
    return joint_filter(trial, smooth=True)


def test_ranges_are_those_of_the_moved_model(trial: Recording) -> None:
    ranges = anchor_ranges(trial)
    assert ranges.names == tuple(f"anchor/{i}" for i in range(1, 5))
    model = load_body(trial.truth.body_xml).mujoco_model()
    data, q = mujoco.MjData(model), np.asarray(trial.truth.trajectory.q)
    exact = np.full_like(ranges.distance, np.nan)
    for k in range(len(ranges.time)):
        data.qpos[:] = q[k]
        mujoco.mj_kinematics(model, data)
        wrist = data.site("source/wrist").xpos
        exact[k] = [np.linalg.norm(data.site(n).xpos - wrist) for n in ranges.names]
    error = (ranges.distance - exact)[np.isfinite(ranges.distance)]
    assert abs(error.mean()) < 5e-4
    # Weak peaks are noisier than the stated noise.
    assert 0.0027 < error.std() < 0.0045


def test_all_trackers_find_an_arm_that_is_as_they_think(trial: Recording, smoothed) -> None:
    paper, best = paper_tracker(trial), optimised(trial, initial=smoothed)
    assert best.solution.status.ok
    for track, wrist_cm, angle_deg in ((paper, 0.6, 4.0), (smoothed, 0.2, 1.0), (best, 0.2, 1.0)):
        errors = track.errors(trial)
        assert errors.std[:2].max() < wrist_cm and np.abs(errors.mean[:2]).max() < wrist_cm / 2
        assert errors.std[2:].max() < angle_deg
    assert not paper.clamped.any() and paper.remarks == ()
    ratio = best.errors(trial).std / paper.errors(trial).std
    assert (ratio < 0.7).all()


def test_outliers_hardly_reach_the_robust_optimum(trial: Recording, smoothed) -> None:
    dirty = simulate_arm(dataclasses.replace(CLEAN, outliers=0.2), seed=1)
    late = np.asarray(dirty.ranges.distance) - np.asarray(trial.ranges.distance)
    assert 0.15 < (late > 0.04).mean() < 0.25
    best = optimised(trial, initial=smoothed).errors(trial)
    robust = optimised(dirty).errors(dirty)
    assert (robust.std < 1.5 * best.std).all()


def test_the_swivel_of_a_spatial_arm_is_said_to_be_undetermined(trial: Recording) -> None:
    spatial = joint_filter(declared(trial, CLEAN, "ball"))
    assert any("does not determine the swivel" in text for text in spatial.remarks)
    assert not any("swivel" in text for text in joint_filter(trial).remarks)


@pytest.mark.parametrize("planar", [True, False])
def test_the_mirror_image_has_the_same_wrist(trial: Recording, smoothed, planar: bool) -> None:
    solution = smoothed.solution
    body = CLEAN.body(kind="planar" if planar else "ball")
    topology = body.topology
    rng = np.random.default_rng(0)
    q = np.tile(np.asarray(body.qpos0), (20, 1))
    if planar:
        q[:, 7] = rng.normal(size=20)
    else:
        q[:, 7:11] = rng.normal(size=(20, 4))
        q[:, 7:11] /= np.linalg.norm(q[:, 7:11], axis=1, keepdims=True)
    q[:, -1] = rng.uniform(-2.0, 0.0, 20)
    P = np.tile(np.diag(rng.uniform(0.5, 1, topology.nv)), (20, 1, 1))
    trajectory = dataclasses.replace(solution.trajectory, time=np.arange(20.0), q=q)
    wrong = dataclasses.replace(solution, body=body, trajectory=trajectory, covariance=P)
    right = bent_forward(wrong)
    found = np.asarray(right.trajectory.q)
    np.testing.assert_allclose(arm_points(body, found).wrist, arm_points(body, q).wrist, atol=1e-9)
    np.testing.assert_allclose(found[:, -1], -q[:, -1])
    assert np.abs(arm_points(body, found).elbow - arm_points(body, q).elbow).max() > 0.01
    assert (np.linalg.eigvalsh(right.covariance) > 0).all()


def test_an_arm_that_leaves_its_plane_and_stretches_is_not_lost() -> None:
    """Full extension has two arms for every wrist, and 4 degrees of abduction centimetres."""
    scene = ArmScene(movement=ArmMovement(seconds=9.0))
    paper = paper_tracker(recording := simulate_arm(scene, seed=0)).errors(recording)
    sagittal = declared(recording, scene, "sagittal")
    errors = joint_filter(sagittal).errors(recording)
    assert (errors.std < [1.18, 2.10, 2.58, 1.78]).all()
    assert (errors.std < 0.8 * paper.std).all()


def test_an_unsure_detection_is_none_for_the_paper_s_filter(trial: Recording) -> None:
    confidence = np.array(trial.ranges.confidence)
    confidence[7] = 0.4
    doubted = dataclasses.replace(
        trial, ranges=dataclasses.replace(trial.ranges, confidence=confidence)
    )
    found, all_of_it = anchor_ranges(doubted).distance, anchor_ranges(doubted, least_confidence=0.3)
    assert np.isnan(found).sum() == np.isnan(all_of_it.distance).sum() + 1


def test_truth_is_the_wrist_without_the_loose_mobile() -> None:
    shaken = dataclasses.replace(
        CLEAN, movement=dataclasses.replace(CLEAN.movement, vibration=0.01)
    )
    points = true_points(simulate_arm(shaken, seed=1))
    np.testing.assert_allclose(
        np.linalg.norm(points.wrist - points.elbow, axis=1), CLEAN.forearm, atol=1e-12
    )


def test_wrong_input(trial: Recording) -> None:
    with pytest.raises(InputError, match="no ranges of 'source/ankle'; sources in the recording"):
        anchor_ranges(trial, "source/ankle")
    with pytest.raises(InputError, match="outliers=1: a share"):
        ArmScene(outliers=1.0)
    with pytest.raises(InputError, match="no truth"):
        paper_tracker(trial).errors(dataclasses.replace(trial, truth=None))
