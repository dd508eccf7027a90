"""A path in the plane from odometry and ranges, simulated here step by step."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.estimate.range_only import AnchorRanges, Odometry, RangeOnlyOptions, range_only_path
from mocap_jax.estimate.range_only.problem import PathProblem, PathState
from mocap_jax.solution import Status

ANCHORS = np.array([[0.0, 0.0], [30.0, 2.0], [28.0, 25.0], [-3.0, 22.0]])
BIAS = np.array([0.5, -0.3, 0.8, 1.2])
START = np.array([5.0, 5.0, 0.3])


def drive(
    seed: int = 0, *, steps: int = 400, bias: np.ndarray = BIAS, scale: float = 0.03,
    turn_bias: float = -0.01, outliers: float = 0.0, noise: float = 0.1,
) -> tuple[np.ndarray, Odometry, AnchorRanges]:  # fmt: skip
    """True poses, and what is measured: no line of the estimator's is used."""
    random = np.random.default_rng(seed)
    h = 0.2
    time = h * np.arange(steps + 1)
    rate = 0.25 * np.sin(0.11 * time[1:]) + 0.12
    fine, pose, poses = 10, START.copy(), [START.copy()]
    for w in rate:
        for _ in range(fine):  # small straight steps
            pose[2] += w * h / fine
            pose[:2] += 1.0 * h / fine * np.array([np.cos(pose[2]), np.sin(pose[2])])
        poses.append(pose.copy())
    poses = np.array(poses)
    distance = h + 0.02 * np.sqrt(h) * random.standard_normal(steps)
    turn = (rate + turn_bias) * h + 0.005 * np.sqrt(h) * random.standard_normal(steps)
    at = np.sort(random.uniform(0, time[-1], 2 * steps))
    anchor = random.integers(0, 4, len(at))
    place = np.stack([np.interp(at, time, x) for x in poses[:, :2].T], axis=1)
    measured = np.linalg.norm(place - ANCHORS[anchor], axis=1) * (1 + scale) + bias[anchor]
    measured += noise * random.standard_normal(len(at))
    gross = random.random(len(at)) < outliers
    measured[gross] += random.uniform(1, 8, gross.sum())
    return poses, Odometry(time, distance, turn), AnchorRanges(at, anchor, measured)


OPTIONS = RangeOnlyOptions(range_noise=0.1)


def test_path_and_constants_are_found_as_well_as_stated() -> None:
    scores, constants = [], []
    for seed in range(4):
        poses, odometry, ranges = drive(seed)
        found = range_only_path(odometry, ranges, ANCHORS, START, OPTIONS)
        assert found.status is Status.CONVERGED
        error = found.pose - poses
        assert np.sqrt((error[:, :2] ** 2).sum(axis=1).mean()) < 0.1
        scores.append((error / found.pose_std)[::40])
        truth = np.array([-0.01, 0.03, *BIAS])
        estimate = np.array([found.turn_bias, found.scale, *found.bias])
        constants.append((estimate - truth) / found.constants_std)
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.4
    assert 0.4 < np.sqrt(np.mean(np.square(constants))) < 1.7


def test_odometry_that_leads_far_astray_is_found_back_from() -> None:
    poses, odometry, ranges = drive(turn_bias=0.03)
    problem = PathProblem(odometry, ranges, ANCHORS, START, OPTIONS)
    lost = problem.dead_reckoned(0.0)[:, :2] - poses[:, :2]
    assert np.linalg.norm(lost, axis=1).max() > 8
    found = range_only_path(odometry, ranges, ANCHORS, START, OPTIONS)
    assert np.linalg.norm(found.pose[:, :2] - poses[:, :2], axis=1).max() < 0.5
    assert found.turn_bias == pytest.approx(0.03, abs=2e-3)


def test_gross_errors_are_seen_through() -> None:
    poses, odometry, ranges = drive(outliers=0.2)
    rms = {}
    for loss in ("cauchy", "none"):
        options = dataclasses.replace(OPTIONS, loss=loss)
        found = range_only_path(odometry, ranges, ANCHORS, START, options)
        rms[loss] = np.sqrt(((found.pose - poses)[:, :2] ** 2).sum(axis=1).mean())
    assert rms["cauchy"] < 0.12 < rms["none"]
    robust = range_only_path(odometry, ranges, ANCHORS, START, OPTIONS)
    assert (robust.weight[robust.range_error > 1.0] < 0.1).all()


def test_constants_of_no_deviation_stay_at_zero_and_cost_accuracy() -> None:
    poses, odometry, ranges = drive()
    held = dataclasses.replace(OPTIONS, bias_sigma=0.0, scale_sigma=0.0)
    found = range_only_path(odometry, ranges, ANCHORS, START, held)
    assert np.abs(found.bias).max() < 1e-9 and abs(found.scale) < 1e-9
    free = range_only_path(odometry, ranges, ANCHORS, START, OPTIONS)
    errors = [np.linalg.norm((f.pose - poses)[:, :2], axis=1).mean() for f in (found, free)]
    assert errors[0] > 3 * errors[1]


@pytest.mark.parametrize("loss", ["none", "cauchy"])
def test_equations_are_the_derivatives_of_the_cost(loss) -> None:
    _, odometry, ranges = drive(steps=6)
    problem = PathProblem(odometry, ranges, ANCHORS, START, dataclasses.replace(OPTIONS, loss=loss))
    random = np.random.default_rng(1)
    pose = problem.dead_reckoned(0.01) + 0.1 * random.standard_normal((7, 3))
    state = PathState(pose, 0.05 * random.standard_normal(6))
    e = problem.linearise(state)
    size = 21 + 6

    def moved(x: np.ndarray) -> float:
        return problem.cost(problem.move(state, x[:21].reshape(7, 3), x[21:]))

    slope = np.concatenate([e.gradient.ravel(), e.corner_gradient])
    for i in range(size):
        x = np.zeros(size)
        x[i] = 1e-6
        assert (moved(x) - moved(-x)) / 2e-6 == pytest.approx(slope[i], rel=2e-5, abs=2e-4)
    if loss == "none":  # J'J by differences of the whitened residuals
        jacobian = np.zeros((0, size))
        rows = []
        for i in range(size):
            x = np.zeros(size)
            x[i] = 1e-6
            ends = [problem.move(state, s * x[:21].reshape(7, 3), s * x[21:]) for s in (1, -1)]
            residuals = [
                np.concatenate([problem._steps(s).value.ravel(), problem.range_errors(s)])
                for s in ends
            ]
            rows.append((residuals[0] - residuals[1]) / 2e-6)
        jacobian = np.array(rows).T
        dense = jacobian.T @ jacobian
        for k in range(7):
            block = dense[3 * k : 3 * k + 3, 3 * k : 3 * k + 3].copy()
            if k == 0:
                block += np.diag([1.0, 1.0, 1 / 0.3**2])
            np.testing.assert_allclose(e.lower[k, 0], block, rtol=1e-5, atol=1e-2)
            border = dense[21:, 3 * k : 3 * k + 3]
            np.testing.assert_allclose(e.border(k), border, rtol=1e-5, atol=1e-2)
            if k < 6:
                below = dense[3 * k + 3 : 3 * k + 6, 3 * k : 3 * k + 3]
                np.testing.assert_allclose(e.lower[k, 1], below, rtol=1e-5, atol=1e-2)


def test_wrong_input_is_named() -> None:
    _, odometry, ranges = drive(steps=30)
    with pytest.raises(InputError, match="name anchor 3; there are 3: 0 to 2"):
        range_only_path(odometry, ranges, ANCHORS[:3], START)
    below = dataclasses.replace(ranges, anchor=ranges.anchor - 2)
    with pytest.raises(InputError, match="name anchor -[12]; there are 4"):
        range_only_path(odometry, below, ANCHORS, START)
    with pytest.raises(InputError, match=r"anchors: .* not of shape \(4, 1\)"):
        range_only_path(odometry, ranges, ANCHORS[:, :1], START)
    with pytest.raises(InputError, match="start .*: must be three numbers"):
        range_only_path(odometry, ranges, ANCHORS, START[:2])
    with pytest.raises(InputError, match="30 times, 30 distances"):
        Odometry(odometry.time[1:], odometry.distance, odometry.turn)
    with pytest.raises(InputError, match="times must rise"):
        Odometry(odometry.time[::-1], odometry.distance, odometry.turn)
    for name in ("time", "distance", "turn"):
        with pytest.raises(InputError, match=f"odometry: {name}: .* not finite"):
            values = np.where(np.arange(len(getattr(odometry, name))) == 3, np.nan, 0.1)
            dataclasses.replace(odometry, **{name: values})
    with pytest.raises(InputError, match="not finite"):
        AnchorRanges(ranges.time, ranges.anchor, ranges.range * np.nan)
    none = AnchorRanges(np.zeros(0), np.zeros(0, int), np.zeros(0))
    with pytest.raises(InputError, match="there are no ranges"):
        range_only_path(odometry, none, ANCHORS, START)
    with pytest.raises(InputError, match="unknown robust loss 'tukey'; valid: .*cauchy"):
        RangeOnlyOptions(loss="tukey")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("forward_noise", 0.0), ("range_noise", np.inf), ("loss_scale", np.nan),
        ("turn_bias_sigma", -0.1), ("bias_sigma", np.inf), ("scale_sigma", np.nan),
        ("start_sigma", (1.0, 0.0)), ("start_sigma", (1.0,)), ("start_sigma", 0.1),
        ("bias_starts", 0),
    ],
)  # fmt: skip
def test_figures_that_make_no_sense_are_refused(name, value) -> None:
    with pytest.raises(InputError, match=f"^{name} .*must be"):
        RangeOnlyOptions(**{name: value})


@pytest.mark.parametrize("late", [-0.5, 0.5])
def test_ranges_without_odometry_are_refused_by_time(late) -> None:
    _, odometry, ranges = drive(steps=30)
    i = 0 if late < 0 else -1
    time = ranges.time.copy()
    time[i] = odometry.time[i] + late
    with pytest.raises(InputError, match=f"1 of 60 .* as {time[i]:g} s; .* valid: 0 to 6 s"):
        range_only_path(odometry, dataclasses.replace(ranges, time=time), ANCHORS, START)
    time[i] = odometry.time[i]  # the ends themselves are inside
    inside = dataclasses.replace(ranges, time=time)
    assert range_only_path(odometry, inside, ANCHORS, START).status.ok


@pytest.fixture
def plaza2(shared_data):
    folder = shared_data / "range_only_plaza2"
    if not (folder / "Plaza2_.mat").is_file():
        pytest.skip(f"no Plaza 2 data at {folder}")
    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
    from real_ranges.plaza2 import read

    return read(folder, 400)


def test_the_first_forty_seconds_of_plaza_2(plaza2) -> None:
    errors = {}
    for name, options in (
        ("all", RangeOnlyOptions()), ("none", RangeOnlyOptions(bias_sigma=0, scale_sigma=0)),
    ):  # fmt: skip
        found = range_only_path(
            plaza2.odometry, plaza2.ranges, plaza2.anchors, plaza2.start, options
        )
        assert found.status is Status.CONVERGED
        errors[name] = plaza2.errors(found.time, found.pose[:, :2]).mean()
    assert errors["all"] < 0.5 < 1.5 < errors["none"]


def test_gtsam_with_our_model_finds_the_same_path(plaza2) -> None:
    pytest.importorskip("gtsam", reason="GTSAM is not installed (extra `ranges`)")
    from real_ranges import gtsam_side

    options = RangeOnlyOptions()
    found = range_only_path(plaza2.odometry, plaza2.ranges, plaza2.anchors, plaza2.start, options)
    theirs = gtsam_side.custom(plaza2, options, found.pose + [0.1, -0.1, 0.01])
    assert np.abs(theirs[:, :2] - found.pose[:, :2]).max() < 0.02
