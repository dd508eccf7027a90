"""Levenberg-Marquardt on small problems of known minimum."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.least_squares import Follow, Outcome, SolverOptions, minimise
from mocap_jax.least_squares.problem import NormalEquations

TIGHT = SolverOptions(max_iterations=200, tolerance=1e-9)


class Plain:
    """Residuals of a plain vector, as a problem of one frame without constants."""

    refines = False
    least_damping = 1e3

    def __init__(self, residuals: Callable, unknowns: int) -> None:
        self.residuals, self.unknowns, self.bends = residuals, unknowns, np.ones(unknowns, bool)
        self.jacobian = jax.jacfwd(residuals)

    def cost(self, x: np.ndarray) -> float:
        return 0.5 * float((np.asarray(self.residuals(jnp.asarray(x))) ** 2).sum())

    def linearise(self, x: np.ndarray, follow: Follow | None = None) -> NormalEquations:
        r, J = (np.asarray(f(jnp.asarray(x))) for f in (self.residuals, self.jacobian))
        return NormalEquations(
            self.cost(x), (J.T @ J)[None, None], (J.T @ r)[None], None, np.zeros(0), None
        )

    def move(self, x: np.ndarray, step: np.ndarray, constants: np.ndarray) -> np.ndarray:
        return x + step[0]

    def model(self, *_: object, **__: object) -> tuple[np.ndarray, np.ndarray]:
        raise NotImplementedError


class Streaming(Plain):
    """The same; its equations are handed over while they are made."""

    def linearise(self, x: np.ndarray, follow: Follow | None = None) -> NormalEquations:
        e = super().linearise(x)
        if follow is not None:
            follow(e.lower, e.border, 1)
        return e


def rosenbrock(x):
    return jnp.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def helical_valley(x):
    turn = jnp.arctan2(x[1], x[0]) / (2 * jnp.pi)
    return jnp.array([10 * (x[2] - 10 * turn), 10 * (jnp.hypot(x[0], x[1]) - 1), x[2]])


def beale(x):
    return jnp.array([c - x[0] * (1 - x[1] ** (i + 1)) for i, c in enumerate((1.5, 2.25, 2.625))])


@pytest.mark.parametrize(
    ("residuals", "start", "minimum"),
    [
        (rosenbrock, [-1.2, 1.0], [1.0, 1.0]),
        (helical_valley, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        (beale, [1.0, 1.0], [3.0, 0.5]),
    ],
)
def test_known_minima(residuals, start, minimum):
    # More, Garbow, Hillstrom 1981: standard starts and minima.
    result = minimise(Plain(residuals, len(start)), np.array(start), TIGHT)
    assert result.outcome is Outcome.CONVERGED
    np.testing.assert_allclose(result.state, minimum, atol=1e-6)
    assert (np.diff(result.cost) < 0).all()


def test_equations_handed_over_early_give_the_same_steps():
    whole, early = (
        minimise(kind(helical_valley, 3), np.array([-1.0, 0.0, 0.0]), TIGHT)
        for kind in (Plain, Streaming)
    )
    np.testing.assert_array_equal(early.cost, whole.cost)


def test_singular_equations_handed_over_early_end_the_iteration():
    result = minimise(
        Streaming(lambda x: x[:1] * jnp.zeros(1), 2), np.ones(2), SolverOptions(initial_damping=0)
    )
    assert result.outcome is Outcome.SINGULAR


def test_a_linear_problem_takes_one_gauss_newton_step():
    result = minimise(
        Plain(lambda x: 3 * (x - 2), 1), np.array([10.0]), SolverOptions(initial_damping=0)
    )
    assert result.outcome is Outcome.CONVERGED
    np.testing.assert_allclose(result.state, 2.0)


def only_at(start: float) -> Callable:
    """A slope whose cost is not finite anywhere but where it starts."""
    return lambda x: jnp.where(x == start, x, jnp.nan + x)


@pytest.mark.parametrize("damping", [1e-3, 0.0])
def test_steps_made_small_by_damping_are_no_convergence(damping):
    problem = Plain(only_at(10.0), 1)
    problem.jacobian = lambda x: jnp.ones((1, 1))
    result = minimise(
        problem, np.array([10.0]), SolverOptions(initial_damping=damping, max_iterations=100)
    )
    assert result.outcome is Outcome.STALLED
    assert result.state == 10.0


class Sequence(Plain):
    """Six frames of one unknown each, pulled to zero."""

    def __init__(self) -> None:
        super().__init__(lambda x: x, 6)
        self.bends, self.least_damping = np.ones(1, bool), 40.0

    def linearise(self, x: np.ndarray, follow: Follow | None = None) -> NormalEquations:
        lower = np.zeros((6, 3, 1, 1))
        lower[:, 0] = 1.0
        return NormalEquations(self.cost(x), lower, x[:, None], None, np.zeros(0), None)

    def move(self, x: np.ndarray, step: np.ndarray, constants: np.ndarray) -> np.ndarray:
        return x + step[:, 0]


@pytest.mark.parametrize(("given", "second"), [(None, 40.0), (40.0, 4.0)])
def test_damping_stays_above_what_the_problem_asks_for_unless_it_is_given(given, second):
    D = np.diff(np.eye(6), 2, axis=0)
    start = np.random.default_rng(1).normal(size=6)
    options = SolverOptions(initial_damping=given, max_iterations=2, tolerance=1e-9)
    expected = start
    for damping in (40.0, second):
        damped = np.eye(6) * (1 + 1e-6 * damping) + damping / 16 * D.T @ D
        expected = expected - np.linalg.solve(damped, expected)
    np.testing.assert_allclose(minimise(Sequence(), start, options).state, expected, atol=1e-6)


def test_unknowns_of_linear_terms_are_not_damped():
    problem = Sequence()
    problem.bends = np.zeros(1, bool)
    options = SolverOptions(max_iterations=1)
    assert np.abs(minimise(problem, np.arange(6.0), options).state).max() < 1e-3
