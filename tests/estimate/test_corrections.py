"""Which further errors of boards are unknowns, how biases walk, and slopes of readings."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic import small_body
from test_sequence_assembly import CORRECTIONS, make

from mocap_jax.errors import InputError
from mocap_jax.estimate import ConstantsOptions, OptimiseOptions
from mocap_jax.estimate.constant_names import calibration, constants_from
from mocap_jax.estimate.derivatives import differentiable
from mocap_jax.estimate.rest_biases import read_in_the_hold
from mocap_jax.estimate.sequence.corner import constant_values, prior_equations
from mocap_jax.estimate.sequence.corrections import correction_fields
from mocap_jax.estimate.sequence.levels import constant_cells
from mocap_jax.estimate.sequence.slopes import slopes
from mocap_jax.estimate.sequence.walk import number_of_steps, walk
from mocap_jax.recording import Setup
from mocap_jax.solution import Solution, Status
from mocap_jax.trajectory import Trajectory

TIME = np.arange(200) / 50
NAMES = ("a", "b", "c", "d")
ALL = ConstantsOptions(
    accelerometer_scale_sigma=0.02, gyroscope_scale_sigma=0.02, clock_offset_sigma=0.005,
    heading_sigma=0.2, bias_interval=2.0,
)  # fmt: skip
NONE = {name: 0 for name in CORRECTIONS}


def readings(force: float = 1.0, rate: float = 1.0, orientation: float = 1.0) -> SimpleNamespace:
    """Two boards' constant readings; NaN for a kind that was not measured."""
    full = lambda x, width: np.full((len(TIME), 2, width), x)  # noqa: E731
    return SimpleNamespace(
        time=TIME, accelerometer=full(force, 3), gyroscope=full(rate, 3),
        orientation=full(orientation, 4), sites=(0, 1),
    )  # fmt: skip


def test_nothing_is_on_by_default() -> None:
    assert correction_fields(readings(), ConstantsOptions()) == NONE


def test_kinds_are_unknown_where_measurements_can_show_them() -> None:
    assert correction_fields(readings(), ALL) == CORRECTIONS
    nan = float("nan")
    still = correction_fields(readings(force=nan, orientation=nan), ALL)
    assert still == NONE | {
        "use_gyroscope_scale": True, "use_clock_offset": True, "gyroscope_steps": 2
    }  # fmt: skip
    assert correction_fields(readings(nan, nan, nan), ALL) == NONE
    fixed = dataclasses.replace(ALL, gyroscope_walk_sigma=0.0)
    assert correction_fields(readings(), fixed)["gyroscope_steps"] == 0


def test_wrong_options_are_refused_by_name() -> None:
    with pytest.raises(InputError, match="clock_offset_sigma -1"):
        correction_fields(readings(), ConstantsOptions(clock_offset_sigma=-1.0))
    with pytest.raises(InputError, match="bias_interval -1"):
        number_of_steps(-1.0, 10.0, 6)
    assert number_of_steps(5.0, 20.0, 108) == 4 and number_of_steps(50.0, 20.0, 108) == 1
    with pytest.raises(InputError, match=r"bias_interval 1: .* valid: (\S+) s or more") as error:
        number_of_steps(1.0, 60.0, 108)
    valid = float(str(error.value).split("valid: ")[1].split(" s")[0])
    assert 1 <= number_of_steps(valid, 60.0, 108) <= 1000 / 108


def test_derivatives_refuse_what_they_do_not_know() -> None:
    options = OptimiseOptions(constants=ALL)
    with pytest.raises(InputError, match="clock_offset_sigma.*bias_interval; valid: 0"):
        differentiable(None, options=options)  # type: ignore[arg-type]


def test_a_walk_is_piecewise_linear_with_mean_zero() -> None:
    w, rng = walk(TIME, 4), np.random.default_rng(0)
    steps = rng.normal(size=4)
    spacing = w.knots[1]
    course, values = w.at_frames @ steps, w.at_knots @ steps
    assert abs(course.mean()) < 1e-12
    np.testing.assert_allclose(np.diff(values), steps * np.sqrt(spacing))
    np.testing.assert_allclose(course, np.interp(TIME, w.knots, values), atol=1e-12)


def test_slopes_of_a_cubic_are_exact_and_gaps_are_bridged() -> None:
    cubic = (1 + 2 * TIME - TIME**2 + 0.3 * TIME**3)[:, None, None] * [1.0, -2.0, 0.5]
    first, second = slopes(cubic, TIME[1], 0.0)
    expected = (2 - 2 * TIME + 0.9 * TIME**2)[:, None, None] * [1.0, -2.0, 0.5]
    np.testing.assert_allclose(first, expected, atol=1e-9)
    expected = (-2 + 1.8 * TIME)[:, None, None] * [1.0, -2.0, 0.5]
    np.testing.assert_allclose(second, expected, atol=1e-7)
    cubic[50:53] = np.nan
    holed = slopes(cubic, TIME[1], 0.0)[0]
    np.testing.assert_allclose(holed, first, atol=1e-9)
    assert not slopes(cubic[:5], TIME[1], 0.0)[0].any()


def test_noise_has_no_slope_and_motion_keeps_its_own() -> None:
    noise = 0.02 * np.random.default_rng(0).normal(size=(len(TIME), 3, 3))
    still = slopes(noise, TIME[1], 0.02)[0]
    alone = slopes(noise, TIME[1], 0.0)[0]
    assert (still**2).mean() < 0.02 * (alone**2).mean()
    wave = np.sin(2 * np.pi * TIME)[:, None, None] * np.ones((3, 3))
    moving = slopes(wave + noise, TIME[1], 0.02)[0]
    true = 2 * np.pi * np.cos(2 * np.pi * TIME)[:, None, None] * np.ones((3, 3))
    inner = slice(3, -3)
    # What is found from it is a quotient: neither too small nor too large.
    slope = (moving * true)[inner].sum() / (moving**2)[inner].sum()
    assert abs(slope - 1) < 0.01


def start(known: dict[str, np.ndarray]) -> Solution:
    body = small_body()
    still = Trajectory(TIME, np.tile(np.asarray(body.qpos0), (len(TIME), 1)))
    return Solution(still, body, Status.CONVERGED, "optimise", Setup(), calibration=known)


def test_constants_survive_being_named_and_looked_up() -> None:
    problem, state = make(2, corrections=CORRECTIONS)
    values, w = constant_values(state.constants), walk(TIME, 2)
    known, deviation = calibration(problem.layout, NAMES, values, np.eye(len(values)), w)
    again = constants_from(start(known), NAMES, problem.layout, w)
    np.testing.assert_allclose(constant_values(again), values, atol=1e-12)
    assert (
        known["gyroscope_bias_walk/a"].shape == deviation["gyroscope_bias_walk/a"].shape == (3, 3)
    )
    assert known["clock_offset/b"].shape == known["heading/b"].shape == (1,)
    middle = w.at_frames @ np.linalg.lstsq(w.at_knots, np.eye(3), rcond=None)[0]
    mean = known["gyroscope_bias/a"]
    off = known["gyroscope_bias_walk/a"] - mean
    np.testing.assert_allclose((middle @ off).mean(0), 0, atol=1e-12)
    root = np.sqrt(1 + (w.at_knots**2).sum(1))
    np.testing.assert_allclose(deviation["gyroscope_bias_walk/a"][:, 0], root)


def test_another_number_of_knots_starts_at_the_mean() -> None:
    problem, _ = make(2, corrections=CORRECTIONS)
    known = {"gyroscope_bias/a": np.ones(3), "gyroscope_bias_walk/a": np.ones((5, 3))}
    found = constants_from(start(known), NAMES, problem.layout, walk(TIME, 2))
    assert not found.corrections.gyroscope_walk.any() and found.gyroscope_bias[0].all()


def test_the_hold_reads_the_bias_that_is_there() -> None:
    problem, state = make(2, corrections=CORRECTIONS)
    layout, w = problem.layout, walk(TIME, 2)
    built = SimpleNamespace(layout=layout, walk=w, rest_frames=np.arange(20))
    mixing = read_in_the_hold(built)
    values, cells = constant_values(state.constants), constant_cells(layout)
    seen = (mixing @ values)[cells["gyroscope_bias"]].reshape(-1, 3)
    steps = values[cells["gyroscope_walk"]].reshape(len(seen), 2, 3)
    course = np.einsum("tj,sjp->tsp", w.at_frames, steps) + state.constants.gyroscope_bias
    np.testing.assert_allclose(seen, course[:20].mean(axis=0))
    none = SimpleNamespace(layout=layout, walk=w, rest_frames=np.zeros(0, int))
    assert read_in_the_hold(none) is None


def test_readings_of_combinations_have_the_right_slope() -> None:
    problem, state = make(2, corrections=CORRECTIONS)
    rng, m = np.random.default_rng(0), problem.layout.constants
    prior, sure, read = rng.uniform(size=m), rng.uniform(size=m), rng.normal(size=m)
    mixing, move = rng.normal(size=(m, m)) / m, rng.normal(size=m)
    still = np.zeros_like(state.q[:, : problem.layout.topology.nv])

    def at(x: float) -> tuple[float, np.ndarray, np.ndarray]:
        c = problem.move(state, still, x * move).constants
        return prior_equations(c, prior, (read, sure), mixing)

    h = 1e-5
    slope = (at(h)[0] - at(-h)[0]) / (2 * h)
    np.testing.assert_allclose(at(0.0)[1] @ move, slope, rtol=1e-7)
    same = prior_equations(state.constants, prior, (read, sure), np.eye(m))
    plain = prior_equations(state.constants, prior, (read, sure))
    for a, b in zip(same, plain, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)
