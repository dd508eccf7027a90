"""`ukf` on a small body whose motion is known, beside `ekf`."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from synthetic import record

from mocap_jax.body import difference
from mocap_jax.estimate import EkfOptions, ekf, ukf
from mocap_jax.metrics import nis
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status

OPTIONS = EkfOptions(remove_averaging=False, smooth=True)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return record(seconds=3.0)


@pytest.fixture(scope="module")
def extended(recording: Recording) -> Solution:
    return ekf(recording, options=OPTIONS)


@pytest.fixture(scope="module")
def unscented(recording: Recording) -> Solution:
    return ukf(recording, options=OPTIONS)


def _between(a: np.ndarray, b: np.ndarray, solution: Solution) -> np.ndarray:
    each = jax.vmap(lambda x, y: difference(solution.body.topology, x, y))
    return np.asarray(each(a, b))


def test_small_errors(unscented: Solution, recording: Recording) -> None:
    assert unscented.status is Status.SMOOTHED and unscented.method == "ukf_smoothed"
    errors = _between(unscented.trajectory.q, recording.truth.trajectory.q, unscented)[:, 6:]
    assert np.rad2deg(np.sqrt((errors**2).mean())) < 0.1


def test_where_all_is_nearly_linear_it_is_the_extended_one(
    unscented: Solution, extended: Solution
) -> None:
    apart = _between(extended.trajectory.q, unscented.trajectory.q, extended)
    sigma = np.sqrt(np.diagonal(extended.covariance, axis1=1, axis2=2))
    share = np.abs(apart) / sigma
    assert 1e-6 < share.max() < 0.2
    ratio = np.sqrt(np.diagonal(unscented.covariance, axis1=1, axis2=2)) / sigma
    np.testing.assert_allclose(ratio, 1.0, atol=0.05)


def test_innovations_are_those_of_the_same_measurements(
    unscented: Solution, extended: Solution
) -> None:
    ours, theirs = nis(unscented), nis(extended)
    assert ours.keys() == theirs.keys()
    for kind, found in ours.items():
        assert found.count == theirs[kind].count
        assert found.value == pytest.approx(theirs[kind].value, rel=0.05)
