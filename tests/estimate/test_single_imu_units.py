"""`smooth_orientation` tells wrong units, and never returns what is worse than its start."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from test_single_imu import simulated

from mocap_jax.errors import InputError
from mocap_jax.estimate import smooth_orientation
from mocap_jax.estimate.single_imu.smooth import _no_worse
from mocap_jax.estimate.single_imu.suspicions import suspicions
from mocap_jax.least_squares import Outcome, Result
from mocap_jax.recording import InertialStream
from mocap_jax.solution import Status


@pytest.fixture(scope="module")
def stream() -> InertialStream:
    return simulated(20.0)[0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gyroscope": np.rad2deg}, "the unit is probably deg/s"),
        ({"accelerometer": lambda a: a / 9.81}, "the unit is probably g"),
    ],
)  # fmt: skip
def test_units_that_cannot_be_are_refused(stream, changes, words):
    wrong = {k: f(getattr(stream, k)) for k, f in changes.items()}
    with pytest.raises(InputError, match=f"the inertial stream: .*{words}"):
        smooth_orientation(dataclasses.replace(stream, **wrong))


def test_sound_readings_are_not_suspected(stream):
    assert suspicions(stream) == ()


def test_units_that_could_be_are_told_and_the_start_is_kept(stream):
    """Slow motion in deg/s is no impossible size; the readings disagree."""
    wrong = dataclasses.replace(
        stream, gyroscope=np.rad2deg(stream.gyroscope / 30)
    )  # below 60 rad/s
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solution = smooth_orientation(wrong)
    assert any("gyroscope" in str(w.message) for w in caught)
    assert any("gyroscope" in text for text in solution.remarks)
    assert solution.cost[-1] <= solution.cost[0]
    assert np.isfinite(solution.quaternion).all()


def test_a_result_above_its_start_is_replaced_by_it():
    worse = Result("end", Outcome.CONVERGED, (10.0, 7.0, 12.0))
    kept, told = _no_worse(worse, "start")
    assert (kept.state, kept.outcome, kept.cost) == ("start", Outcome.STALLED, (10.0,))
    assert "from a cost of 10 to one of 12" in told[0]
    assert _no_worse(Result("end", Outcome.CONVERGED, (10.0, 7.0)), "start") == (
        Result("end", Outcome.CONVERGED, (10.0, 7.0)), (),
    )  # fmt: skip


def test_the_status_says_so(stream, monkeypatch):
    from mocap_jax.estimate.single_imu import smooth

    def uphill(problem, state, options):
        moved = problem.move(state, 0.01 * np.ones((len(state.bias), 12)), np.zeros(15))
        return Result(moved, Outcome.CONVERGED, (problem.cost(state), problem.cost(moved)))

    monkeypatch.setattr(smooth, "minimise", uphill)
    solution = smooth_orientation(stream)
    assert solution.status is Status.STALLED and len(solution.cost) == 1
    assert np.isnan(solution.orientation_std).all()
    assert "the start is returned" in solution.remarks[-1]
