"""Deviations of constants, and which sensors err, on problems small enough to do by hand."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from test_sequence_assembly import M, make

from mocap_jax import linalg
from mocap_jax.estimate.sequence.adapt import _constants
from mocap_jax.estimate.sequence.corner import constant_values
from mocap_jax.estimate.sequence.levels import (
    KINDS,
    Levels,
    any_wrong,
    constant_cells,
    declared_deviations,
    initial_levels,
    mostly_wrong,
    prior_from,
)
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions, OptimiseOptions

DECLARED = ConstantsOptions()
ONCE = np.ones(M)
LEVELS = initial_levels(OptimiseOptions(), 4)


def found(
    information: np.ndarray, values: np.ndarray, counts: np.ndarray = ONCE, damping: float = 0.0
) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """New deviations where the data determine each constant alone; and the cells of each kind.

    Args:
        information: of the data (m,).
        values: the constants that the data would give without priors (m,).
        counts: how often each prior counts (m,).
        damping: added before the equations are factored.
    """
    problem, state = make(2)
    prior = prior_from(LEVELS, problem.layout, counts)
    problem.prior_information = prior
    # At a solution, priors have pulled the constants towards zero.
    state = with_constants(problem, state, values * information / (information + prior))
    corner = np.diag(information + prior + damping)
    f = linalg.ArrowFactor(np.zeros((0, 6, 2)), np.sqrt(corner), damping=damping)
    return (
        _constants(problem, state, f, LEVELS, counts, DECLARED),
        constant_cells(problem.layout),
    )


def with_constants(problem: SequenceProblem, state: State, values: np.ndarray) -> State:
    zero = without_constants(state)
    moved = problem.move(zero, np.zeros_like(state.q[:, : problem.layout.topology.nv]), values)
    np.testing.assert_allclose(constant_values(moved.constants), values, atol=1e-12)
    return moved


def without_constants(state: State) -> State:
    c = state.constants
    none = {n: np.zeros_like(getattr(c, n)) for n in ("gyroscope_bias", "accelerometer_bias")}
    geometry = dataclasses.replace(
        c.geometry,
        **{f.name: 0 * getattr(c.geometry, f.name) for f in dataclasses.fields(c.geometry)},
    )
    plain = np.tile(np.eye(3), (len(c.mounting), 1, 1))
    return State(
        state.q,
        dataclasses.replace(c, **none, mounting=plain, offset=0 * c.offset, geometry=geometry),
    )


def drawn(share: float) -> np.ndarray:
    """Constants of this share of what is declared."""
    sigma = 1 / np.sqrt(prior_from(LEVELS, make(2)[0].layout, ONCE))
    return share * sigma * np.random.default_rng(5).normal(size=M)


def test_determined_constants_show_their_own_size() -> None:
    values = drawn(0.3)
    deviations, cells = found(np.full(M, 1e12), values)
    for name, at in cells.items():
        size = np.sqrt((values[at] ** 2).mean())
        np.testing.assert_allclose(deviations[name], size, rtol=1e-3, err_msg=name)


def test_deviations_stay_between_a_thousandth_and_what_is_declared() -> None:
    declared = declared_deviations(DECLARED)
    assert found(np.full(M, 1e12), drawn(15.0))[0] == pytest.approx(declared)
    small = found(np.full(M, 1e14), drawn(0.0))[0]
    for name, sigma in declared.items():
        assert small[name] == pytest.approx(1e-3 * sigma, rel=0.2), name


def test_what_the_data_leave_open_keeps_its_deviation_where_it_is_geometry() -> None:
    """No sign of a length is no sign that lengths are right."""
    deviations, _ = found(np.full(M, 1e-9), drawn(1.0))
    declared = declared_deviations(DECLARED)
    for name in ("length", "source", "sound", "range_offset"):
        assert deviations[name] == pytest.approx(declared[name], rel=1e-3), name


def by_hand(v: float, information: float, sigma: float, count: float) -> float:
    """One geometric constant, twice: mean(v^2 + var) with the prior moved to what was found."""
    gathered = information * v
    for _ in range(2):
        whole = information + count / sigma**2
        sigma = np.sqrt((gathered / whole) ** 2 + count / whole)
    return sigma


@pytest.mark.parametrize("count", [1.0, 20.0])
def test_one_constant_by_hand(count: float) -> None:
    values, information = drawn(0.2), np.full(M, 1e4)
    deviations, cells = found(information, values, np.full(M, count))
    at = int(cells["sound"][0])
    expected = by_hand(values[at], 1e4, DECLARED.sound_sigma, count)
    assert deviations["sound"] == pytest.approx(min(expected, DECLARED.sound_sigma))


@pytest.mark.parametrize("damping", [1.0, 1e4, 1e6])
def test_damping_of_the_factor_is_not_taken_for_data(damping: float) -> None:
    values, information = drawn(0.3), np.full(M, 1e3)
    damped, plain = (found(information, values, damping=d)[0] for d in (damping, 0.0))
    assert damped == pytest.approx(plain, rel=1e-6)


def built(measured: dict[str, list[bool]], *, use_range: bool = False) -> SimpleNamespace:
    """Arrays in which a sensor's readings of a kind are there or not; never in the first frame."""
    variances = {
        kind: (np.array([[np.inf] * len(there), np.where(there, 1.0, np.inf)]), None)
        for kind, there in measured.items()
    }
    return SimpleNamespace(variances=variances, layout=SimpleNamespace(use_range=use_range))


def levels(ranges: float = 0.0, **shares: tuple[float, ...]) -> Levels:
    none = dict.fromkeys(KINDS, (0.0, 0.0, 0.0)) | {"range": (ranges,)}
    return dataclasses.replace(LEVELS, share=none | shares)


def test_a_sensor_errs_only_in_what_it_measures() -> None:
    measured = {
        "accelerometer": [True, True, False],
        "gyroscope": [True, True, True],
        "orientation": [False, False, False],
    }
    some = built(measured)
    assert not any_wrong(levels(), some)
    assert any_wrong(levels(gyroscope=(0.0, 0.0, 0.1)), some)
    assert not any_wrong(levels(accelerometer=(0.0, 0.0, 0.1)), some)
    assert not any_wrong(levels(orientation=(1.0, 1.0, 1.0)), some)
    assert not mostly_wrong(levels(gyroscope=(0.0, 0.0, 0.1)), some)


def test_ranges_err_only_where_they_are_used() -> None:
    measured = {k: [True] * 3 for k in KINDS if k != "range"}
    for used in (True, False):
        assert any_wrong(levels(0.5), built(measured, use_range=used)) == used
    assert not any_wrong(levels(0.0), built(measured, use_range=True))
