"""Normalised errors and coverage of draws from the stated covariance."""

import dataclasses

import numpy as np
import pytest
from small_person import moved, person, recording, solution, swing

from mocap_jax.errors import InputError
from mocap_jax.metrics import (
    chi_square_band,
    coverage,
    evaluate,
    joint_consistency,
    nees,
    nis,
)
from mocap_jax.metrics.consistency import tangent_errors
from mocap_jax.trajectory import Trajectory


@pytest.fixture(scope="module")
def drawn():
    """Truth drawn about the estimate from a correlated covariance."""
    rng = np.random.default_rng(1)
    body = person()
    estimate = swing(body, frames=600)
    factor = 0.02 * rng.normal(size=(body.nv, body.nv)) / np.sqrt(body.nv)
    P = factor @ factor.T + 1e-5 * np.eye(body.nv)
    delta = rng.multivariate_normal(np.zeros(body.nv), P, 600)
    truth = Trajectory(estimate.time, moved(body, np.asarray(estimate.q), delta))
    return solution(body, estimate, covariance=np.repeat(P[None], 600, 0)), recording(truth)


def test_honest_covariance(drawn):
    values = nees(*drawn)
    assert values.shape == (600,)
    assert values.mean() == pytest.approx(1.0, abs=0.03)
    assert coverage(*drawn).mean() == pytest.approx(0.95, abs=0.01)
    assert coverage(*drawn, level=0.5).mean() == pytest.approx(0.5, abs=0.02)


def test_overconfidence_shows(drawn):
    estimate, truth = drawn
    proud = dataclasses.replace(estimate, covariance=estimate.covariance / 4)
    assert nees(proud, truth).mean() == pytest.approx(4.0, abs=0.12)
    assert coverage(proud, truth).mean() == pytest.approx(0.673, abs=0.02)


def test_needs_a_covariance(drawn):
    estimate, truth = drawn
    with pytest.raises(InputError, match="no covariance"):
        nees(dataclasses.replace(estimate, covariance=None), truth)
    with pytest.raises(InputError, match="level"):
        coverage(estimate, truth, level=95)


def test_undetermined_directions_are_not_a_number(drawn):
    estimate, truth = drawn
    P = np.array(estimate.covariance)
    P[:10, 0] = P[:10, :, 0] = 0.0
    values = nees(dataclasses.replace(estimate, covariance=P), truth)
    assert np.isnan(values[:10]).all() and np.isfinite(values[10:]).all()


def test_joint_consistency_of_honest_and_overconfident_covariances(drawn):
    estimate, truth = drawn
    honest = joint_consistency(estimate, truth)
    assert honest.ratio == pytest.approx(1.0, abs=0.04)
    assert honest.coverage == pytest.approx(0.95, abs=0.02)
    proud = dataclasses.replace(estimate, covariance=estimate.covariance / 4)
    assert joint_consistency(proud, truth).ratio == pytest.approx(2 * honest.ratio)
    assert joint_consistency(proud, truth).rms == honest.rms


def test_joint_consistency_is_of_the_observed_joints_alone(drawn):
    estimate, truth = drawn
    elbow = dataclasses.replace(estimate, observed=("RightForeArm",))
    topology = estimate.body.topology
    dof = topology.joint_dof[topology.joint_names.index("right_elbow")]
    error, covariance = tangent_errors(estimate, truth)
    found = joint_consistency(elbow, truth)
    assert found.rms == pytest.approx(np.sqrt(np.mean(error[:, dof] ** 2)))
    assert found.predicted_rms == pytest.approx(np.sqrt(covariance[0, dof, dof]))
    assert found.coverage == pytest.approx(coverage(estimate, truth)[dof])


def test_rms_of_a_ball_joint_is_that_of_its_rotation(drawn):
    estimate, truth = drawn
    neck = dataclasses.replace(estimate, observed=("Head",))
    expected = evaluate(estimate, truth)["orientation_error_rmse_deg"]["Head"]
    assert np.rad2deg(joint_consistency(neck, truth).rms) == pytest.approx(expected, rel=1e-6)


def test_joint_consistency_needs_joints_and_a_level(drawn):
    estimate, truth = drawn
    with pytest.raises(InputError, match="observe no joint"):
        joint_consistency(dataclasses.replace(estimate, observed=("Pelvis",)), truth)
    with pytest.raises(InputError, match="level"):
        joint_consistency(estimate, truth, level=1.5)


def test_joints_alone_do_not_feel_the_root(drawn):
    estimate, truth = drawn
    values = nees(estimate, truth, part="joints")
    assert values.mean() == pytest.approx(1.0, abs=0.03)
    # A free root drifts: its error says nothing about the joints, nor does its covariance.
    body, path = estimate.body, estimate.trajectory
    drift = np.zeros((len(path.time), body.nv))
    drift[:, :6] = 5.0
    away = Trajectory(path.time, moved(body, np.asarray(path.q), drift))
    lost = dataclasses.replace(estimate, trajectory=away)
    np.testing.assert_allclose(nees(lost, truth, part="joints"), values, rtol=1e-9)
    assert nees(lost, truth).mean() > 1e3
    with pytest.raises(InputError, match="unknown part 'joint'; valid: joints, pose"):
        nees(estimate, truth, part="joint")


def test_band_of_a_mean_of_squares():
    low, high = chi_square_band(250)
    squares = (np.random.default_rng(0).normal(size=(4000, 250)) ** 2).mean(axis=1)
    assert ((squares > low) & (squares < high)).mean() == pytest.approx(0.95, abs=0.01)
    assert low < 1 < high
    with pytest.raises(InputError, match="count=0"):
        chi_square_band(0)
    with pytest.raises(InputError, match="level"):
        chi_square_band(10, 95)


def test_normalised_innovations_by_kind(drawn):
    estimate, _ = drawn
    filtered = dataclasses.replace(
        estimate, method="ekf",
        innovations={"gyroscope": {"squared": 1010.0, "count": 1000},
                     "range": {"squared": 300.0, "count": 150}},
    )  # fmt: skip
    found = nis(filtered)
    assert found["gyroscope"].value == pytest.approx(1.01) and found["gyroscope"].honest
    assert found["range"].value == pytest.approx(2.0) and not found["range"].honest
    assert found["range"].band == chi_square_band(150)
    with pytest.raises(InputError, match="method optimise.*holds no innovations"):
        nis(estimate)
