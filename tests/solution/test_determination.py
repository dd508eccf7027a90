"""What a recording tells of constants, on posteriors written down by hand."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.recording import Setup
from mocap_jax.solution import (
    Solution,
    Status,
    determination,
    determination_remark,
    stated_determination,
)
from mocap_jax.trajectory import Trajectory

XML = """<mujoco><worldbody><body><joint type="hinge"/><geom size=".1"/></body></worldbody>
</mujoco>"""


def solved(prior: dict[str, np.ndarray], covariance: np.ndarray | None) -> Solution:
    body = load_body(XML)
    still = Trajectory(np.arange(2.0), np.zeros((2, body.nq)))
    return Solution(
        still, body, Status.CONVERGED, "optimise", Setup(), calibration_prior_std=prior,
        calibration_covariance=covariance,
    )  # fmt: skip


def test_what_the_prior_tells_is_told_apart_from_what_the_data_tell() -> None:
    prior = {"gyroscope_bias/a": np.full(3, 0.01), "speed_of_sound/air": np.array([0.02])}
    # x is known to a tenth, y and z in their sum alone, the speed of sound not at all.
    C = np.diag([1e-6, 0.0, 0.0, 0.02**2])
    C[1:3, 1:3] = 5e-5 * np.array([[1, -1], [-1, 1]]) + 1e-8
    found = determination(solved(prior, C))
    assert (found.count, found.rank) == (4, 2)
    assert [name for name, _ in found.undetermined] == ["speed_of_sound/air"]
    ((a, b, rho),) = found.correlated
    assert (a, b) == ("gyroscope_bias/a/y", "gyroscope_bias/a/z")
    assert rho == pytest.approx(-1, abs=1e-3)
    assert "2 of 4" in str(found) and "speed_of_sound/air" in str(found)


def test_steps_of_walks_are_named_and_whole_constants_are_said_once() -> None:
    prior = {
        "gyroscope_bias/a": np.full(3, 0.01), "gyroscope_bias_walk/a": np.full((2, 3), 1e-3),
        "clock_offset/a": np.array([0.005]),
    }  # fmt: skip
    C = np.diag([1e-8] * 3 + [1e-10, 9.9e-7, 9.8e-7, 9.7e-7, 9.6e-7, 9.5e-7, 1e-8])
    made = solved(prior, C)
    found = determination(made)
    assert [n for n, _ in found.undetermined][:2] == [
        "gyroscope_bias_walk/a/step 1/y", "gyroscope_bias_walk/a/step 1/z"
    ]  # fmt: skip
    text = determination_remark(made)
    assert "gyroscope_bias_walk/a/step 1/z, gyroscope_bias_walk/a/step 2." in text
    assert "5 of 10" in text and "\n" not in text
    kept = dataclasses.replace(made, remarks=("Else.", text))
    assert stated_determination(kept) == text and stated_determination(made) == ""
    assert determination_remark(dataclasses.replace(made, calibration_covariance=None)) == ""


def test_pinned_constants_do_not_count() -> None:
    prior = {"speed_of_sound/air": np.array([1e-7]), "segment_length/Hand": np.array([0.04])}
    found = determination(solved(prior, np.diag([1e-14, 1e-6])))
    assert (found.count, found.rank, found.undetermined) == (1, 1, ())


def test_a_solution_without_constants_is_refused() -> None:
    filtered = dataclasses.replace(solved({}, None), method="ekf")
    with pytest.raises(InputError, match="'ekf'"):
        determination(filtered)
