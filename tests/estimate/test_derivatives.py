"""Implicit derivatives of an estimate against differences of estimates that were solved again."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.estimate import OptimiseOptions
from mocap_jax.estimate.derivatives import Differentiable, Parameters, differentiable
from mocap_jax.estimate.derivatives.objective import Point, constant_vector, cost
from mocap_jax.estimate.derivatives.parameters import terms_of
from mocap_jax.estimate.whole_sequence import solve_sequence
from mocap_jax.recording import Recording
from tests.estimate.synthetic import record

# Estimates solved again differ by this much from the minimum, in units of `Case.value`.
RESOLUTION = 1e-11
# Parameters of no effect on the small body: it has no orientations, joint limits or shared joints.
WITHOUT_EFFECT = ("orientation", "limit_sigma", "joint_range", "shared_")


class Case(NamedTuple):
    estimate: Differentiable
    weights: np.ndarray
    constant_weights: np.ndarray

    def value(self, p: Parameters) -> jax.Array:
        """A number that every unknown has a part in."""
        found = self.estimate(p)
        constants = constant_vector(found.constants)
        return (self.weights * found.q).sum() + self.constant_weights @ constants


@pytest.fixture(scope="module")
def recording() -> Recording:
    """With a gap in one board's readings."""
    recording = record(seconds=3.5, rate_hz=60.0)
    board = recording.inertial["forearm"]
    force, rate = np.array(board.accelerometer), np.array(board.gyroscope)
    force[120:124], rate[150:153] = np.nan, np.nan
    holed = dataclasses.replace(board, accelerometer=force, gyroscope=rate)
    return dataclasses.replace(recording, inertial=recording.inertial | {"forearm": holed})


@pytest.fixture(scope="module")
def case(recording: Recording) -> Case:
    # Some model errors stay, so that their shares are parameters of effect.
    options = OptimiseOptions()
    options = dataclasses.replace(options, noise=dataclasses.replace(options.noise, adapt=False))
    estimate = differentiable(recording, options=options)
    rng = np.random.default_rng(0)
    q, constants = estimate.solution.trajectory.q, estimate._layout.constants
    return Case(estimate, rng.normal(size=q.shape), rng.normal(size=constants))


@pytest.fixture(scope="module")
def gradient(case: Case) -> Parameters:
    return jax.grad(case.value)(case.estimate.parameters)


def leaves(p: Parameters) -> dict[str, np.ndarray]:
    return {jax.tree_util.keystr(k): x for k, x in jax.tree.leaves_with_path(p)}


def moved(p: Parameters, name: str, change: np.ndarray) -> Parameters:
    return jax.tree_util.tree_map_with_path(
        lambda k, x: x + change if jax.tree_util.keystr(k) == name else x, p
    )


@pytest.mark.slow
def test_the_cost_is_the_solver_s(recording: Recording, case: Case) -> None:
    _, run = solve_sequence(recording, options=dataclasses.replace(
        OptimiseOptions(), noise=dataclasses.replace(OptimiseOptions().noise, adapt=False)
    ))  # fmt: skip
    estimate, problem = case.estimate, run.problem
    point = Point(jnp.asarray(run.state.q), run.state.constants)
    got = cost(problem.layout, estimate._bound(estimate.parameters), point)
    assert float(got) == pytest.approx(problem.cost(run.state), rel=1e-9)


@pytest.mark.slow
def test_parameters_of_the_solution_give_its_problem(case: Case) -> None:
    estimate = case.estimate
    got = terms_of(
        estimate._layout, estimate._fixed, estimate.parameters, estimate._sound,
        estimate._weights.step,
    )  # fmt: skip
    for field in dataclasses.fields(got):
        expected = getattr(estimate._fixed.terms, field.name)
        if field.name in ("user_data", "user_mask"):
            continue
        used = getattr(got, field.name)
        if field.name in ("force", "rate", "mean_rate"):  # absent rows have no information
            info = {"force": "force", "rate": "force", "mean_rate": "rate"}[field.name]
            there = np.asarray(getattr(estimate._fixed.terms, f"{info}_information")) > 0
            used, expected = np.asarray(used)[there], np.asarray(expected)[there]
        np.testing.assert_allclose(used, expected, rtol=1e-9, atol=1e-12, err_msg=field.name)


@pytest.mark.slow
def test_gradient_is_that_of_estimates_solved_again(case: Case, gradient: Parameters) -> None:
    """Every kind of parameter, along a random direction, to 1e-4 of the derivative."""
    base, rng, wrong, silent = leaves(case.estimate.parameters), np.random.default_rng(1), {}, []
    for name, slope in leaves(gradient).items():
        start = np.asarray(base[name])
        if not np.isfinite(start).all() or not start.size:
            continue
        direction = rng.normal(size=start.shape) * (np.abs(start).max() or 1.0)
        size = 2e-4 if name.startswith((".body", ".measurements")) else 0.02
        expected = slope_of(
            lambda h, name=name, direction=direction: float(
                case.value(moved(case.estimate.parameters, name, h * direction))
            ),
            size,
        )
        got = float((slope * direction).sum())
        if abs(expected) < 1e-12:
            silent.append(name)
        elif abs(got - expected) > 1e-4 * abs(expected) + RESOLUTION / size:
            wrong[name] = (got, expected)
    assert not wrong
    unexpected = [n for n in silent if not any(part in n for part in WITHOUT_EFFECT)]
    assert not unexpected


def slope_of(value: Callable[[float], float], size: float) -> float:
    """Derivative at 0, of sixth order: variances are far from linear in shares and deviations.

    Four points alone err by h^4: 6e-4 at twice the step for the share of the ranges' model error.
    """
    at = {h: value(h * size) for h in (-2, -1, -0.5, 0.5, 1, 2)}

    def fourth(h: float) -> float:
        return (at[-2 * h] - 8 * at[-h] + 8 * at[h] - at[2 * h]) / (12 * h * size)

    return (16 * fourth(0.5) - fourth(1)) / 15


@pytest.mark.slow
def test_forward_mode_and_vmap_agree_with_the_gradient(case: Case, gradient: Parameters) -> None:
    p = case.estimate.parameters
    rng = np.random.default_rng(2)
    readings = rng.normal(size=(3, *p.measurements.gyroscope.shape))

    def along(direction: jax.Array) -> jax.Array:
        def value(shift: jax.Array) -> jax.Array:
            measured = dataclasses.replace(
                p.measurements, gyroscope=p.measurements.gyroscope + shift
            )
            return case.value(dataclasses.replace(p, measurements=measured))

        zero = jnp.zeros_like(direction)
        return jax.jvp(value, (zero,), (direction,))[1]

    got = jax.vmap(along)(jnp.asarray(readings))
    expected = (readings * np.asarray(gradient.measurements.gyroscope)).sum((1, 2, 3))
    np.testing.assert_allclose(got, expected, rtol=1e-6)


@pytest.mark.slow
def test_missing_readings_have_no_derivative(case: Case, gradient: Parameters) -> None:
    assert all(np.isfinite(x).all() for x in jax.tree.leaves(gradient))
    forearm = list(case.estimate.sensors).index("forearm")
    slopes = np.asarray(gradient.measurements.gyroscope)[:, forearm]
    assert not slopes[150:153].any() and np.abs(slopes[140:147]).min() > 0


def test_single_precision_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match="dtype 'float32'.*valid: 'float64'"):
        differentiable(recording, options=OptimiseOptions(dtype="float32"))
