"""Choice of segments: bounds, exhaustive search, exchange and constraints, on set functions."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.placement.certificate import Certificate
from mocap_jax.placement.options import Constraints
from mocap_jax.placement.selection import Candidates, Selector

SEGMENTS = ("Pelvis", "Head", "RightHand", "LeftHand", "RightFoot", "LeftFoot")
N = len(SEGMENTS)


class Bank:
    """tr (P + sum w_i H_i)^-1 for random information matrices: convex like the real criterion."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        rows = rng.normal(size=(N, 2, 5)) * rng.uniform(0.3, 2, (N, 1, 1))
        self.own = np.einsum("nri,nrj->nij", rows, rows)
        self.prior = 0.3 * np.eye(5)

    def value(self, weights: np.ndarray) -> float:
        return float(np.trace(np.linalg.inv(self.prior + np.tensordot(weights, self.own, 1))))

    def of(self, subset: tuple[int, ...]) -> float:
        return self.value(np.isin(np.arange(N), subset).astype(float))

    def relax(self, weights: np.ndarray) -> tuple[float, float, np.ndarray]:
        y = np.linalg.inv(self.prior + np.tensordot(weights, self.own, 1))
        f = float(np.trace(y))
        slope = np.array([np.trace(y @ h @ y) for h in self.own]) / f**2
        return f, float(np.trace(y @ self.prior @ y)) / f**2, slope


def selector(bank: Bank, **constraints) -> Selector:
    wire = np.array([0.0, 0.8, 0.9, 0.9, 1.0, 1.0])
    return Selector(
        Candidates(SEGMENTS, np.array([1.0, 1, 2, 2, 1, 1]), wire), Constraints(**constraints),
        bank.of, bank.relax,
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("count", [2, 3])
def test_bound_then_exhaustive_optimum_then_rounded(seed: int, count: int):
    bank = Bank(seed)
    best = min(map(bank.of, combinations(range(N), count)))
    all_tried, proof = selector(bank).choose(count, budget=100)
    assert proof.exhaustive and bank.of(all_tried) == pytest.approx(best)
    assert proof.gap == 0
    short = selector(bank)
    rounded, certificate = short.choose(count, budget=10)
    assert not certificate.exhaustive
    assert 0 < certificate.bound <= best * (1 + 1e-9)
    assert certificate.value == pytest.approx(bank.of(rounded))
    assert best <= certificate.value * (1 + 1e-12)
    assert certificate.gap == pytest.approx(1 - certificate.bound / certificate.value)


def test_bound_is_near_the_relaxed_optimum():
    """Against projected search over many random weights."""
    bank = Bank(1)
    one = selector(bank)
    one._relaxed(3)
    bound = 1 / one._programme(3)[1]
    rng = np.random.default_rng(0)
    best = np.inf
    for _ in range(4000):
        weights = rng.dirichlet(np.ones(N)) * 3
        if weights.max() <= 1:
            best = min(best, bank.value(weights))
    assert bound <= best
    assert bound > 0.8 * best


def test_constraints_are_respected():
    bank = Bank(3)
    for chosen, check in (
        (dict(required=("Head",)), lambda s: 1 in s),
        (dict(budget=3.0), lambda s: sum(2 if i in (2, 3) else 1 for i in s) <= 3),
        (dict(wire_m=1.8), lambda s: sum([0, 0.8, 0.9, 0.9, 1, 1][i] for i in s) <= 1.8),
    ):
        for budget in (100, 8):
            subset, _ = selector(bank, **chosen).choose(3, budget=budget)
            assert check(subset), (chosen, budget, subset)


def test_symmetric_choices_come_in_pairs():
    for budget in (100, 3):
        subset, _ = selector(Bank(2), symmetric=True).choose(3, budget=budget)
        assert (2 in subset) == (3 in subset) and (4 in subset) == (5 in subset)


def test_impossible_constraints_are_refused():
    for budget in (100, 1):
        with pytest.raises(InputError, match="no 5 sensors respect"):
            selector(Bank(0), budget=4.0).choose(5, budget=budget)
    with pytest.raises(InputError, match="'Tail'.*Pelvis"):
        selector(Bank(0), required=("Tail",))


def test_certificates_speak_of_segments_as_of_sources():
    """What was dropped is told; that exchanges do not help is said of the best of all only."""
    sentences = [
        Certificate(2.0, bound, 10, exhaustive, dropped).sentence
        for bound in (0.0, 1.0) for exhaustive in (False, True) for dropped in (0, 2)
    ]  # fmt: skip
    for sentence in sentences:
        assert "segment" not in sentence and "objective" not in sentence
        told = ("but 2 better, left out" in sentence, "no exchange" in sentence)
        assert told in {(True, False), (False, "exhaustive" not in sentence)}
    assert "none is better by more than 50 %" in sentences[4]
