"""Sentences that judge: the best method, a smoother that did harm, bands that are too narrow."""

import dataclasses

import numpy as np
import pytest
from small_person import moved, person, recording, setup, solution, swing

from mocap_jax.metrics import ErrorTable, coverage
from mocap_jax.report.verdicts import (
    Coverage,
    accuracy_verdict,
    consistency_table,
    coverages,
    uncertainty_verdict,
)
from mocap_jax.trajectory import Trajectory


def table(observed: float, position: float = 1.0) -> ErrorTable:
    errors = {
        "orientation_error_mean_deg": {"mean": 2 * observed, "mean_observed": observed},
        "position_error_mean_cm": {"mean": position},
    }
    return ErrorTable(errors, ("Head",), (), 10, (0.0, 1.0))


@pytest.fixture(scope="module")
def methods():
    body = person()
    made = solution(body, swing(body), method="ekf", statistics={"root": {"rms": 1.0}})
    return {
        "Kalman filter": made,
        "Kalman smoother": dataclasses.replace(made, method="ekf_smoothed"),
        "Optimiser": dataclasses.replace(made, method="optimise", statistics={}),
    }


def verdict(methods, *tables: ErrorTable) -> str:
    return accuracy_verdict(dict(zip(methods, tables, strict=True)), methods)


def test_best_method_is_named_with_all_numbers(methods):
    text = verdict(methods, table(3.0), table(2.5), table(1.0))
    assert text == (
        "Optimiser is best on observed joints: mean error 1.00 deg, against 2.50 deg "
        "(Kalman smoother) and 3.00 deg (Kalman filter)."
    )


def test_smoother_worse_than_its_filter_is_said(methods):
    text = verdict(methods, table(3.0), table(4.0), table(5.0))
    assert text.startswith("Kalman filter is best on observed joints")
    assert "Kalman smoother is less accurate than Kalman filter, which it was made from" in text
    assert "observed joints (4.00 against 3.00 deg)" in text and "smoothing did harm" in text


def test_a_smoother_is_not_blamed_for_another_filter(methods):
    other = dict(methods)
    other["Kalman filter"] = dataclasses.replace(
        methods["Kalman filter"], statistics={"root": {"rms": 2.0}}
    )
    text = accuracy_verdict(dict(zip(other, map(table, (3.0, 4.0, 5.0)), strict=True)), other)
    assert "made from" not in text


def test_better_on_another_measure_and_equal_methods(methods):
    text = verdict(methods, table(3.0), table(3.0), table(1.0, position=2.0))
    assert "Kalman filter is better on joint centres (1.00 against 2.00 cm)." in text
    assert "less accurate" not in text
    text = verdict(methods, table(3.0), table(3.01), table(3.0))
    assert "All methods are equally accurate on observed joints (3.00 deg)." in text


def test_without_observed_joints_all_joints_judge(methods):
    blind = [
        ErrorTable({"orientation_error_mean_deg": {"mean": x}}, (), (), 1, (0.0, 1.0))
        for x in (3.0, 2.0, 1.0)
    ]
    assert verdict(methods, *blind).startswith("Optimiser is best on all joints")
    assert accuracy_verdict({}, methods) == ""
    one = {"Optimiser": methods["Optimiser"]}
    assert accuracy_verdict({"Optimiser": table(1.0)}, one) == (
        "Optimiser: mean error 1.00 deg on observed joints."
    )


@pytest.mark.parametrize(
    ("share", "word"),
    [(42.0, "over-confident"), (89.9, "over-confident"), (90.0, "about right"),
     (98.0, "about right"), (98.1, "too cautious")],
)  # fmt: skip
def test_words_of_coverage(share, word):
    assert Coverage(share, 1.0).word == word


def test_uncertainty_is_judged_by_measured_coverage():
    """Errors drawn with half, once and five times the deviation that is stated."""
    body = person()
    truth = swing(body, frames=200)
    reference = recording(truth)
    found = {}
    for name, stated in (("narrow", 0.5), ("honest", 1.0), ("wide", 5.0)):
        delta = np.random.default_rng(1).normal(0.0, 0.01, (200, body.nv))
        found[name] = solution(
            body, Trajectory(truth.time, moved(body, np.asarray(truth.q), delta)), setup=setup(),
            covariance=np.repeat((0.01 * stated) ** 2 * np.eye(body.nv)[None], 200, 0),
        )  # fmt: skip
    judged = coverages(found, reference)
    assert [c.word for c in judged.values()] == ["over-confident", "about right", "too cautious"]
    assert judged["narrow"].ratio == pytest.approx(2.0, rel=0.05)
    share = 100 * coverage(found["narrow"], reference).mean()
    text = uncertainty_verdict(judged)
    assert f"Over-confident: the 95 % bands cover {share:.0f} % (narrow) of the errors" in text
    assert "About right" in text and "Too cautious" in text
    assert [row.cells[-1] for row in consistency_table(judged).rows] == [
        "over-confident", "about right", "too cautious",
    ]  # fmt: skip
    assert not coverages(found, None) and uncertainty_verdict({}) == ""
    assert consistency_table({}) is None
