"""Which segments get a sensor: relaxation, rounding, exchange, and how good that provably is.

The relaxed problem lets each candidate have a weight in [0, 1] with a given sum. 1/f is concave in
the weights (see `evaluation`), so every evaluation gives a plane above it, and the linear programme
over all planes found so far bounds f from below, for fractional and so for whole choices (Kelley's
cutting planes). The bound is true but loose: a board with a hundredth of its weight still knows a
segment's rotation well, so fractions of boards on all segments are better than whole ones on a few.
Where the number of choices allows it, all are evaluated; otherwise rounding and greedy choice are
improved by exchanging segments until no exchange helps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.optimize import linprog

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.placement.certificate import Certificate
from mocap_jax.placement.options import Constraints

Subset = tuple[int, ...]
"""Indices of chosen candidates, ascending."""

_WORKERS = 2
_PLANES = 12


@dataclass(frozen=True)
class Candidates:
    """Places that a sensor may take, one or more by segment, and what they cost."""

    segments: tuple[str, ...]
    cost: Float[np.ndarray, "n"]
    wire: Float[np.ndarray, "n"]
    """Length of wire from the hub [m]."""
    farthest: Float[np.ndarray, "n n"] | None = None
    """What distance two sensors cannot exceed [m]; None: far enough."""

    def within(self, chosen: list[int], c: Constraints) -> bool:
        """Whether cost, wire and distances keep to their limits."""
        if c.budget is not None and self.cost[chosen].sum() > c.budget + 1e-9:
            return False
        if c.wire_m is not None and self.wire[chosen].sum() > c.wire_m + 1e-9:
            return False
        if self.farthest is None:
            return True
        pairs = np.triu_indices(len(chosen), 1)
        return bool((self.farthest[np.ix_(chosen, chosen)][pairs] >= c.distance_m).all())

    def units(self, symmetric: bool) -> tuple[Subset, ...]:
        """Candidates that are chosen together: pairs of left and right if symmetric."""
        if not symmetric:
            return tuple((i,) for i in range(len(self.segments)))
        units: list[Subset] = []
        for i, name in enumerate(self.segments):
            if name.startswith("Right"):
                twin = "Left" + name.removeprefix("Right")
                if twin in self.segments:
                    units.append(tuple(sorted((i, self.segments.index(twin)))))
            elif not name.startswith("Left"):
                units.append((i,))
        return tuple(units)


@dataclass
class Selector:
    """Searches for the best subsets; remembers all that were evaluated."""

    candidates: Candidates
    constraints: Constraints
    evaluate: Callable[[Subset], float]
    """Criterion of a subset, exactly."""
    relax: Callable[[np.ndarray], tuple[float, float, np.ndarray]] | None = None
    """Criterion at weights, and the plane (constant, slope) above 1/f."""
    report: Callable[[], object] = lambda: None
    """Called after every evaluation."""
    values: dict[Subset, float] = field(default_factory=dict)
    planes: list[tuple[float, np.ndarray]] = field(default_factory=list)

    def __post_init__(self) -> None:
        for name in self.constraints.required:
            if name not in self.candidates.segments:
                raise unknown_name("required segment", name, self.candidates.segments)

    def choose(self, count: int, *, budget: int, bound: bool = True) -> tuple[Subset, Certificate]:
        """The best subset of a size that `budget` evaluations find.

        Raises:
            InputError: the constraints leave no choice.
        """
        choices = self._choices(count, budget)
        before = len(self.values)
        if choices is not None:
            if not choices:
                raise InputError(f"no {count} sensors respect the constraints")
            self._evaluate_all(choices)
            best = min(choices, key=self.values.__getitem__)
            value = self.values[best]
            return best, Certificate(value, value, len(choices), exhaustive=True)
        weights = self._relaxed(count) if bound and self.relax else None
        start = self._greedy(count, weights)
        best = self._exchange(start, before + budget)
        value = self.values[best]
        least = 1 / self._programme(count)[1] if self.planes else 0.0
        return best, Certificate(value, min(least, value), len(self.values) - before, False)

    def ranking(self, count: int, length: int | None = None) -> list[Subset]:
        """Best subsets evaluated so far, the best first."""
        of_size = [s for s in self.values if len(s) == count]
        return sorted(of_size, key=self.values.__getitem__)[:length]

    def feasible(self, subset: Subset) -> bool:
        """Whether a subset respects the constraints."""
        c, chosen = self.constraints, list(subset)
        names = [self.candidates.segments[i] for i in chosen]
        if len(set(names)) < len(names) or not set(c.required) <= set(names):
            return False
        return self.candidates.within(chosen, c)

    def _choices(self, count: int, limit: int) -> list[Subset] | None:
        """All feasible subsets, or None if there are more than the limit (times a safety)."""
        found: list[Subset] = []
        units = self.candidates.units(self.constraints.symmetric)
        tried = 0
        for size in range(1, count + 1):
            for chosen in combinations(units, size):
                tried += 1
                subset = tuple(sorted(i for u in chosen for i in u))
                if len(subset) == count and self.feasible(subset):
                    found.append(subset)
                if len(found) > limit or tried > 500_000:
                    return None
        return found

    def _evaluate_all(self, subsets: Iterable[Subset]) -> None:
        new = [s for s in dict.fromkeys(subsets) if s not in self.values]
        with ThreadPoolExecutor(_WORKERS) as pool:
            for subset, value in zip(new, pool.map(self.evaluate, new), strict=True):
                self.values[subset] = value
                self.report()

    def _greedy(self, count: int, weights: np.ndarray | None) -> Subset:
        """The better of rounded weights and of the best smaller subset with its best addition."""
        starts = []
        if weights is not None:
            starts += self._rounded(count, weights)
        # One less, or two less where left and right go together.
        smaller: list[Subset] = [s for less in (1, 2) for s in self.ranking(count - less, 1)]
        for subset in (smaller if count > 2 else []) or [()]:
            starts += self._grown(count, subset)
        self._evaluate_all(starts)
        if not starts:
            raise InputError(f"no {count} sensors respect the constraints")
        return min(starts, key=self.values.__getitem__)

    def _grown(self, count: int, subset: Subset) -> list[Subset]:
        units = self.candidates.units(self.constraints.symmetric)
        required = {self.candidates.segments.index(n) for n in self.constraints.required}
        chosen = set(subset) | {i for u in units if required & set(u) for i in u}
        while len(chosen) < count:
            room = count - len(chosen)
            fitting = [u for u in units if not chosen & set(u) and len(u) <= room]
            options: list[Subset] = [tuple(sorted(chosen | set(u))) for u in fitting]
            grown = [s for s in options if self.candidates.within(list(s), self.constraints)]
            if not grown:
                return []
            whole = [s for s in grown if len(s) == count]
            if room <= 2 and whole:
                return [s for s in whole if self.feasible(s)]
            self._evaluate_all(grown)
            best: Subset = min(grown, key=lambda s: self.values[s])
            chosen = set(best)
        final = tuple(sorted(chosen))
        return [final] if len(final) == count and self.feasible(final) else []

    def _rounded(self, count: int, weights: np.ndarray) -> list[Subset]:
        """The feasible subset of largest weights."""
        units = sorted(
            self.candidates.units(self.constraints.symmetric),
            key=lambda u: -weights[list(u)].mean(),
        )
        required = {self.candidates.segments.index(n) for n in self.constraints.required}
        units = sorted(units, key=lambda u: not required & set(u))
        chosen: set[int] = set()
        for u in units:
            grown = tuple(sorted(chosen | set(u)))
            if len(grown) <= count and self.candidates.within(list(grown), self.constraints):
                chosen |= set(u)
        subset = tuple(sorted(chosen))
        return [subset] if len(subset) == count and self.feasible(subset) else []

    def _exchange(self, subset: Subset, limit: int) -> Subset:
        """Exchange one unit for another of its size as long as that helps and evaluations last."""
        blocks = self._blocks()
        improved = True
        while improved and len(self.values) < limit:
            improved = False
            for out in [b for b in blocks if set(b) <= set(subset)]:
                kept = set(subset) - set(out)
                swaps = [
                    tuple(sorted(kept | set(b)))
                    for b in blocks
                    if len(b) == len(out) and not set(b) & set(subset)
                ]
                swaps = [s for s in swaps if self.feasible(s)]
                if not swaps or len(self.values) >= limit:
                    continue
                self._evaluate_all(swaps)
                best = min(swaps, key=self.values.__getitem__)
                if self.values[best] < self.values[subset]:
                    subset, improved = best, True
                    break
        return subset

    def _blocks(self) -> list[Subset]:
        """What is exchanged for one another: units, and two single ones for a pair."""
        units = list(self.candidates.units(self.constraints.symmetric))
        if self.constraints.symmetric:
            singles = [u for u in units if len(u) == 1]
            # Pairs first: they are few and matter most.
            units.sort(key=len, reverse=True)
            units += [tuple(sorted(a + b)) for a, b in combinations(singles, 2)]
        return units

    def _relaxed(self, count: int) -> np.ndarray:
        """Best weights found by cutting planes."""
        assert self.relax is not None
        n = len(self.candidates.segments)
        weights = np.full(n, count / n)
        best, best_value = weights, np.inf
        for _ in range(_PLANES):
            value, constant, slope = self.relax(weights)
            self.report()
            self.planes.append((constant, slope))
            if value < best_value:
                best, best_value = weights, value
            ahead, top = self._programme(count)
            if best_value * top < 1.02:
                break
            # Half-way to the programme's vertex: whole steps jump about.
            weights = 0.5 * (best + ahead)
        return best

    def _programme(self, count: int) -> tuple[np.ndarray, float]:
        """Weights that maximise the planes' minimum, and that maximum of 1/f."""
        n, c = len(self.candidates.segments), self.constraints
        scale = max(abs(constant) + np.abs(slope).max() for constant, slope in self.planes)
        above = [[*(-slope / scale), 1.0] for _, slope in self.planes]
        limits = [constant / scale for constant, _ in self.planes]
        for cost, most in ((self.candidates.cost, c.budget), (self.candidates.wire, c.wire_m)):
            if most is not None:
                above.append([*cost, 0.0])
                limits.append(most)
        equal, total = [[*np.ones(n), 0.0]], [float(count)]
        for u in self.candidates.units(c.symmetric):
            if len(u) == 2:
                row = np.zeros(n + 1)
                row[list(u)] = 1.0, -1.0
                equal.append(list(row))
                total.append(0.0)
        required = {self.candidates.segments.index(name) for name in c.required}
        bounds = [(1.0 if i in required else 0.0, 1.0) for i in range(n)] + [(0.0, None)]
        found = linprog(
            [*np.zeros(n), -1.0], A_ub=above, b_ub=limits, A_eq=equal, b_eq=total, bounds=bounds
        )
        if found.status != 0:
            raise InputError(f"no {count} sensors respect the constraints")
        return found.x[:-1], float(-found.fun * scale)
