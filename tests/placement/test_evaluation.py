"""Criteria: against dense inverses, slopes against finite differences, bounds."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.body import Body
from mocap_jax.placement import Judge, PlacementOptions
from mocap_jax.placement.evaluation import Criterion
from mocap_jax.placement.options import OBJECTIVES
from mocap_jax.placement.posterior import posterior_of
from mocap_jax.placement.rows import Boards

SEGMENTS = ("Pelvis", "T8", "RightForeArm")
POSITION = ((0.1, 0.0, 0.0), (0.11, 0.03, 0.1), (0.0, -0.04, -0.12))


@pytest.fixture(scope="module")
def boards(person: Body) -> Boards:
    index = [person.topology.body_index(n) for n in SEGMENTS]
    return Boards(jnp.asarray(index), jnp.asarray(POSITION), jnp.array([1.0, 0.5, 1.0]))


@pytest.fixture(scope="module")
def scenes(person: Body, motions: tuple, quick: PlacementOptions) -> tuple:
    return Judge(person, motions, quick).criterion.scenes


@pytest.mark.parametrize("over", ["mean", "worst"])
@pytest.mark.parametrize("objective", ["A", "E", "worst"])
def test_slope_is_that_of_the_value(scenes, boards, quick, objective: str, over: str):
    options = dataclasses.replace(quick, objective=objective, over=over)
    criterion = Criterion(scenes, options)
    slope = criterion.slope(boards, criterion.evaluate(boards))
    for i, axis in ((0, 2), (1, 1), (2, 0)):

        def value(d: float, i: int = i, axis: int = axis) -> float:
            position = boards.position.at[i, axis].add(d)
            return criterion.evaluate(boards._replace(position=position)).value

        expected = (value(2e-3) - value(-2e-3)) / 4e-3
        # The power iteration for E ends a little before it has converged.
        tolerance = 2e-2 if objective == "E" else 2e-3
        np.testing.assert_allclose(
            slope[i, axis], expected, rtol=tolerance, atol=tolerance * np.abs(slope).max()
        )


def test_slope_of_the_volume_is_right_in_the_mean(scenes, boards, quick):
    """Its trace is drawn at random: many seeds together."""
    options = dataclasses.replace(quick, objective="D")
    found = []
    for seed in range(12):
        search = dataclasses.replace(options.search, seed=seed)
        criterion = Criterion(scenes[:1], dataclasses.replace(options, search=search))
        found.append(criterion.slope(boards, criterion.evaluate(boards))[2, 0])

    def value(d: float) -> float:
        return criterion.evaluate(boards._replace(position=boards.position.at[2, 0].add(d))).value

    expected = (value(2e-3) - value(-2e-3)) / 4e-3
    spread = np.std(found) / np.sqrt(len(found))
    assert abs(np.mean(found) - expected) < 4 * spread + 1e-3 * abs(expected)


def test_variance_is_that_of_the_dense_inverse(scenes, boards, quick):
    """Many random signs come close to the exact trace."""
    scene = scenes[0]
    posterior = posterior_of(scene, boards, quick.errors)
    t, nv = scene.frames, scene.body.nv
    eye = np.eye(t * nv).reshape(t, nv, t * nv)
    covariance = posterior.solve(eye)[0].reshape(t * nv, t * nv)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-8 * np.abs(covariance).max())
    exact = []
    for target in scene.target:
        rows = np.zeros((t, 3, t, nv))
        rows[np.arange(t), :, np.arange(t)] = target
        rows = rows.reshape(3 * t, t * nv)
        exact.append(np.trace(rows @ covariance @ rows.T))
    criterion = Criterion((scene,), dataclasses.replace(quick, probes=400))
    found = criterion.evaluate(boards).variance[0]
    np.testing.assert_allclose(found, exact, rtol=0.15, atol=1e-9)


@pytest.mark.parametrize("over", ["mean", "worst"])
@pytest.mark.parametrize("objective", ["A", "E", "worst"])
def test_cuts_bound_the_value_from_below(scenes, boards, quick, objective: str, over: str):
    criterion = Criterion(scenes, dataclasses.replace(quick, objective=objective, over=over))
    here = criterion.evaluate(boards)
    cut = criterion.cut(boards, here)
    np.testing.assert_allclose(cut.bound(np.asarray(boards.weight)), here.value, rtol=1e-6)
    rng = np.random.default_rng(0)
    for weight in (*rng.uniform(0, 1, (4, 3)), np.eye(3)[0], np.ones(3)):
        value = criterion.evaluate(boards._replace(weight=jnp.asarray(weight))).value
        assert cut.bound(weight) <= value * (1 + 1e-9)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_more_sensors_are_never_worse(scenes, boards, quick, objective: str):
    criterion = Criterion(scenes, dataclasses.replace(quick, objective=objective))
    values = [
        criterion.evaluate(boards._replace(weight=jnp.asarray(w))).value
        for w in ([1.0, 0, 0], [1.0, 1, 0], [1.0, 1, 1])
    ]
    assert values[0] > values[1] > values[2]


def test_risk_is_that_of_the_dense_gain(scenes, boards, quick):
    """Noise through the gain, and the pull of the priors on this very motion."""
    scene = scenes[0]
    criterion = Criterion((scene,), dataclasses.replace(quick, probes=400))
    evaluation = criterion.evaluate(boards)
    posterior = evaluation.posteriors[0]
    t, nv = scene.frames, scene.body.nv
    eye = np.eye(t * nv).reshape(t, nv, t * nv)
    covariance = posterior.solve(eye)[0].reshape(t * nv, t * nv)
    prior = np.zeros((t + 2, nv, t + 2, nv))
    for o in range(3):
        for k in range(t):
            prior[k + o, :, k] = scene.prior.lower[k, o]
            prior[k, :, k + o] = scene.prior.lower[k, o].T
    prior = prior[:t, :, :t].reshape(t * nv, t * nv)
    spread = covariance - covariance @ prior @ covariance
    bias = covariance @ scene.prior.pull.ravel()
    expected = []
    for target in scene.target:
        rows = np.zeros((t, 3, t, nv))
        rows[np.arange(t), :, np.arange(t)] = target
        rows = rows.reshape(3 * t, t * nv)
        expected.append(np.trace(rows @ spread @ rows.T) + ((rows @ bias) ** 2).sum())
    np.testing.assert_allclose(criterion.risk(evaluation)[0], expected, rtol=0.15, atol=1e-9)
