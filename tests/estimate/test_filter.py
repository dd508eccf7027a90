"""`ekf` on a small body whose motion is known."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np
import pytest
from synthetic import record

from mocap_jax.body import difference
from mocap_jax.errors import InputError
from mocap_jax.estimate import EkfOptions, ekf, filter
from mocap_jax.metrics import nis
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status, uncertainty

INSTANTS = EkfOptions(remove_averaging=False)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return record()


@pytest.fixture(scope="module")
def filtered(recording: Recording) -> Solution:
    return ekf(recording, options=INSTANTS)


@pytest.fixture(scope="module")
def smoothed(recording: Recording) -> Solution:
    return ekf(recording, options=dataclasses.replace(INSTANTS, smooth=True))


def _errors(solution: Solution, recording: Recording) -> np.ndarray:
    """Pose errors (t, nv)."""
    topology = solution.body.topology
    truth = np.asarray(recording.truth.trajectory.q)
    each = jax.vmap(lambda a, b: difference(topology, a, b))
    return np.asarray(each(solution.trajectory.q, truth))


def _joint_rms_deg(solution: Solution, recording: Recording) -> float:
    return float(np.rad2deg(np.sqrt((_errors(solution, recording)[:, 6:] ** 2).mean())))


def test_small_errors(filtered: Solution, recording: Recording) -> None:
    assert filtered.status is Status.FILTERED
    assert _joint_rms_deg(filtered, recording) < 0.1
    assert filtered.trajectory.v.shape == (len(filtered.trajectory.time), filtered.body.nv)


def test_smoothing_helps_and_is_surer(
    filtered: Solution, smoothed: Solution, recording: Recording
) -> None:
    assert smoothed.status is Status.SMOOTHED
    assert _joint_rms_deg(smoothed, recording) < _joint_rms_deg(filtered, recording)
    spread = lambda s: np.trace(s.covariance, axis1=1, axis2=2)  # noqa: E731
    assert (spread(smoothed) <= spread(filtered) * (1 + 1e-9)).all()
    np.testing.assert_allclose(smoothed.trajectory.q[-1], filtered.trajectory.q[-1], atol=1e-12)


def test_neighbours_of_the_smoother(smoothed: Solution, recording: Recording) -> None:
    """Errors of successive poses are almost the same, and velocities are known accordingly."""
    options = dataclasses.replace(INSTANTS, smooth=True, pair_covariance=True)
    paired = ekf(recording, options=options)
    np.testing.assert_allclose(paired.trajectory.q, smoothed.trajectory.q, atol=1e-12)
    P, C = np.asarray(paired.covariance), np.asarray(paired.pair_covariance)
    assert C.shape == (len(P) - 1, *P.shape[1:])
    joint = np.block([[P[1:], C], [np.swapaxes(C, 1, 2), P[:-1]]])
    scale = np.sqrt(np.diagonal(joint, axis1=1, axis2=2))
    lowest = np.linalg.eigvalsh(joint / scale[:, None] / scale[:, :, None])[:, 0]
    assert (lowest > -1e-9).all()
    step = np.diff(np.asarray(paired.trajectory.time))[:, None]
    topology = paired.body.topology
    between = jax.vmap(lambda a, b: difference(topology, a, b))
    found, true = (
        np.asarray(between(q[:-1], q[1:])) / step
        for q in (np.asarray(paired.trajectory.q), np.asarray(recording.truth.trajectory.q))
    )
    squared = ((found - true) / uncertainty(paired).velocity_std.values) ** 2
    assert 0.01 < squared[20:-20].mean() < 2.0


def test_neighbours_need_the_smoother() -> None:
    with pytest.raises(InputError, match="needs smooth=True"):
        EkfOptions(pair_covariance=True)


def test_innovations_are_as_large_as_expected(filtered: Solution, smoothed: Solution) -> None:
    found = nis(filtered)
    frames = len(filtered.trajectory.time)
    assert found["gyroscope"].count == 9 * frames and found["root"].count == 6 * frames
    # The recording is all but free of noise and its motion smooth: nothing surprises the filter.
    assert all(0 < x.value < 1.5 for x in found.values())
    assert nis(smoothed).keys() == found.keys()


def test_result_does_not_depend_on_the_chunks(
    smoothed: Solution, recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    # With room for one chunk's beliefs the smoother has to filter the others again.
    monkeypatch.setattr(filter, "_KEPT_BYTES", 0)
    assert len(smoothed.trajectory.time) > 200
    other = ekf(recording, options=dataclasses.replace(INSTANTS, smooth=True, chunk=100))
    np.testing.assert_allclose(other.trajectory.q, smoothed.trajectory.q, atol=1e-9)
    np.testing.assert_allclose(other.covariance, smoothed.covariance, atol=1e-9)


def test_statistics(filtered: Solution) -> None:
    names = set(filtered.statistics)
    assert {"root", "accelerometer/pelvis", "gyroscope/forearm", "range/belly-forearm"} <= names
    assert 0.9 < filtered.statistics["root"]["rms"] < 1.1
    assert 0.8 < filtered.statistics["range/belly-forearm"]["rms"] < 1.2
    n = len(filtered.trajectory.time)
    assert filtered.statistics["gyroscope/pelvis"]["count"] == 3 * n


def test_missing_data_is_bridged(recording: Recording) -> None:
    stream = recording.inertial["forearm"]
    gyroscope = np.array(stream.gyroscope)
    gyroscope[400:430] = np.nan
    inertial = recording.inertial | {"forearm": dataclasses.replace(stream, gyroscope=gyroscope)}
    solution = ekf(dataclasses.replace(recording, inertial=inertial), options=INSTANTS)
    assert _joint_rms_deg(solution, recording) < 0.5


def test_outlying_ranges_do_little(recording: Recording, filtered: Solution) -> None:
    distance = np.array(recording.ranges.distance)
    distance[::7] += 0.6
    ranges = dataclasses.replace(recording.ranges, distance=distance)
    solution = ekf(dataclasses.replace(recording, ranges=ranges), options=INSTANTS)
    assert _joint_rms_deg(solution, recording) < 2 * _joint_rms_deg(filtered, recording)


def test_printed_dynamics_and_single_precision(recording: Recording) -> None:
    for changes, limit in (({"process": "paper"}, 2.0), ({"dtype": "float32"}, 0.2)):
        solution = ekf(recording, options=dataclasses.replace(INSTANTS, **changes))
        assert solution.status is Status.FILTERED
        assert np.isfinite(solution.covariance).all()
        assert _joint_rms_deg(solution, recording) < limit


def test_free_root(recording: Recording) -> None:
    solution = ekf(recording, options=dataclasses.replace(INSTANTS, root="free"))
    assert "root" not in solution.statistics
    assert _joint_rms_deg(solution, recording) < 0.2


def test_wrong_input(recording: Recording) -> None:
    with pytest.raises(InputError, match="unknown process 'jerk'"):
        EkfOptions(process="jerk")  # type: ignore[arg-type]
    without = dataclasses.replace(recording, root=None)
    with pytest.raises(InputError, match="no measured root"):
        ekf(without, options=EkfOptions(root="given"))
    with pytest.raises(InputError, match=r"no body\.xml"):
        ekf(dataclasses.replace(recording, body_xml=None))
