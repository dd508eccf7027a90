"""Constants of body, sources and air found with the motion, and the rest hold's bias readings."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mocap_jax.estimate import ConstantsOptions, OptimiseOptions, optimise
from mocap_jax.recording import Recording, RestHold
from mocap_jax.solution import Solution, determination
from tests.estimate.synthetic import SENSORS, XML, record

SHORTER, FASTER, LATE = 0.05, 0.006, 0.003
BIAS = np.array([0.012, -0.008, 0.01])


@pytest.fixture(scope="module")
def wrong() -> Recording:
    """A forearm 5 % longer than the body says, warmer air, a late source, a biased gyroscope."""
    recording = record(seconds=5.0)
    ranges = recording.ranges
    heard = np.asarray(ranges.distance) / (1 + FASTER) + LATE
    board = recording.inertial["forearm"]
    inertial = recording.inertial | {
        "forearm": dataclasses.replace(board, gyroscope=np.asarray(board.gyroscope) + BIAS)
    }
    nominal = XML.replace('name="ForeArm" pos="0 .3 0"', f'name="ForeArm" pos="0 {0.3 - 0.015} 0"')
    assert nominal != XML
    return dataclasses.replace(
        recording, body_xml=nominal, inertial=inertial,
        ranges=dataclasses.replace(ranges, distance=heard),
    )  # fmt: skip


@pytest.fixture(scope="module")
def solved(wrong: Recording) -> Solution:
    return optimise(wrong, options=OptimiseOptions(pair_covariance=True))


@pytest.mark.parametrize(
    ("name", "true", "sure"),
    [
        ("segment_length/ForeArm", 0.3 / (0.3 - 0.015) - 1, 0.01),
        ("speed_of_sound/air", FASTER, 0.006),
        ("source_offset/belly", LATE, 0.003),
        ("gyroscope_bias/forearm", BIAS, 1e-3),
    ],
)
def test_constants_are_found_within_their_deviation(
    solved: Solution, name: str, true: float | np.ndarray, sure: float
) -> None:
    deviation = np.ravel(solved.calibration_std[name])
    error = np.ravel(solved.calibration[name]) - true
    assert (deviation < sure).all(), deviation
    assert (np.abs(error) < 4 * deviation + 1e-12).all(), (error, deviation)


def test_neighbours_are_one_distribution_with_the_poses(solved: Solution) -> None:
    P, C = np.asarray(solved.covariance), np.asarray(solved.pair_covariance)
    assert C.shape == (len(P) - 1, *P.shape[1:])
    joint = np.block([[P[1:], C], [np.swapaxes(C, 1, 2), P[:-1]]])
    scale = np.sqrt(np.diagonal(joint, axis1=1, axis2=2))
    correlation = joint / scale[:, None] / scale[:, :, None]
    assert (np.linalg.eigvalsh(correlation)[:, 0] > -1e-9).all()
    # Errors of successive frames are almost the same.
    assert np.diagonal(correlation[:, : P.shape[1], P.shape[1] :], axis1=1, axis2=2).min() > 0.5


def test_what_was_found_counts_as_determined(solved: Solution) -> None:
    found = determination(solved)
    assert 0 < found.rank < found.count
    unknown = {name for name, _ in found.undetermined}
    assert not unknown & {"segment_length/ForeArm", "gyroscope_bias/forearm/x"}
    flat = np.concatenate([np.ravel(x) for x in solved.calibration_std.values()])
    np.testing.assert_allclose(np.sqrt(np.diag(solved.calibration_covariance)), flat)


def test_ranges_alone_call_for_the_geometry(wrong: Recording) -> None:
    without = optimise(wrong, options=OptimiseOptions(kinds="AG", covariance=False))
    assert not [k for k in without.calibration if k.split("/")[0] in ("segment_length", "source")]
    off = ConstantsOptions(length_sigma=0.0, sound_sigma=0.0)
    pinned = optimise(wrong, options=OptimiseOptions(constants=off, covariance=False))
    kinds = {k.split("/")[0] for k in pinned.calibration}
    assert "source_offset" in kinds and not kinds & {"segment_length", "speed_of_sound"}


def test_a_rest_hold_without_length_reads_nothing(wrong: Recording) -> None:
    setup = dataclasses.replace(wrong.setup, rest=RestHold(1.0, 1.0, {}))
    solution = optimise(
        dataclasses.replace(wrong, setup=setup), options=OptimiseOptions(covariance=False)
    )
    assert solution.status.ok
    assert {f"gyroscope_bias/{s}" for s in SENSORS} <= set(solution.calibration)
