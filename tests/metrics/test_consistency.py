"""Normalised errors and coverage of draws from the stated covariance."""

import dataclasses

import numpy as np
import pytest
from small_person import moved, person, recording, solution, swing

from mocap_jax.errors import InputError
from mocap_jax.metrics import coverage, nees
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
