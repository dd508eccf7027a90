"""Cells gathered to rows of a table: pooled over seeds, and over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vlasic2007.cells import METHODS, Cell
from vlasic2007.paper import COMBINATIONS, JOINTS

Moments = tuple[float, float]


@dataclass(frozen=True)
class Row:
    """One combination of sensors and one method, pooled over seeds."""

    combination: str
    method: str
    seeds: frozenset[int]
    failed: int
    """How many of them gave no usable estimate."""
    folded: tuple[Moments, ...]
    """Mean and standard deviation of each joint's error [deg]; empty where all failed."""
    unfolded: tuple[Moments, ...]
    observed: float
    """Mean error over the observed joints [deg]; NaN where the sensors observe none."""
    frames_per_second: float
    """Median over seeds, without compilation."""

    @property
    def mean(self) -> float:
        """Mean over the three joints of the folded error [deg]."""
        return float(np.mean([m for m, _ in self.folded])) if self.folded else float("nan")


class Results:
    """Stored cells, by motion and profile."""

    def __init__(self, cells: list[tuple[Cell, dict]], wanted: int) -> None:
        self.cells = cells
        self.wanted = wanted
        self._by: dict[tuple, dict[int, dict]] = {}
        for cell, scores in cells:
            key = (cell.label, cell.condition, cell.combination, cell.method)
            self._by.setdefault(key, {})[cell.seed] = scores

    @property
    def sections(self) -> list[tuple[str, str]]:
        """Pairs of motion and condition of which something is there."""
        return list(dict.fromkeys((cell.label, cell.condition) for cell, _ in self.cells))

    def scores(self, section: tuple[str, str], combination: str, method: str) -> dict[int, dict]:
        """Scores by seed."""
        return self._by.get((*section, combination, method), {})

    def rows(self, section: tuple[str, str]) -> list[Row]:
        """All rows of a section, in the paper's order."""
        found = (self.row(section, c, m) for c in COMBINATIONS for m in METHODS)
        return [row for row in found if row is not None]

    def row(
        self, section: tuple[str, str], combination: str, method: str,
        seeds: frozenset[int] | None = None,
    ) -> Row | None:  # fmt: skip
        """One row, of all its seeds or of some; None where there is nothing."""
        scores = self.scores(section, combination, method)
        if seeds is not None:
            scores = {seed: s for seed, s in scores.items() if seed in seeds}
        if not scores:
            return None
        usable = [s for s in scores.values() if "table1" in s]
        rates = [s["frames"] / s["seconds_solve"] for s in usable]
        return Row(
            combination, method, frozenset(scores), len(scores) - len(usable),
            _pooled(usable, "folded"), _pooled(usable, "unfolded"), _observed(usable),
            float(np.median(rates)) if rates else float("nan"),
        )  # fmt: skip

    def pair(
        self, section: tuple[str, str], one: tuple[str, str], other: tuple[str, str]
    ) -> tuple[Row, Row] | None:
        """Two rows (combination, method) on the seeds that both have."""
        common = frozenset(self.scores(section, *one)) & frozenset(self.scores(section, *other))
        first, second = (self.row(section, *which, common) for which in (one, other))
        return None if first is None or second is None else (first, second)


def _pooled(usable: list[dict], kind: str) -> tuple[Moments, ...]:
    """Mean and standard deviation over all frames of all seeds, by joint."""
    if not usable:
        return ()
    out = []
    for joint in JOINTS:
        count, total, squares = np.sum([s["table1"][joint][kind] for s in usable], axis=0)
        mean = total / count
        out.append((float(mean), float(np.sqrt(max(squares / count - mean**2, 0.0)))))
    return tuple(out)


def _observed(usable: list[dict]) -> float:
    values = [s["orientation_error_mean_deg"].get("mean_observed") for s in usable]
    known = [v for v in values if v is not None]
    return float(np.mean(known)) if known else float("nan")
