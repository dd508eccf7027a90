"""Verdicts in words: which method is best, and whether the stated uncertainty is honest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.metrics import ErrorTable, coverage, joint_consistency, nees
from mocap_jax.recording import Recording
from mocap_jax.report.tables import Row, Table, number
from mocap_jax.solution import Solution
from mocap_jax.solution.methods import FILTER_OF

# Two errors that differ by less than this share are called equal.
_EQUAL = 0.01
# Share of errors inside 95 % bands [%] from which on they are honest, and too wide.
_HONEST, _WIDE = 90.0, 98.0
_ORIENTATION = "orientation_error_mean_deg"
# Metric, aggregate, name in a sentence, unit. Judged by the first; the others are mentioned.
_JUDGED = (
    (_ORIENTATION, "mean_observed", "observed joints", "deg"),
    (_ORIENTATION, "mean", "all joints", "deg"),
    (_ORIENTATION, "mean_table1", "neck, right shoulder and left hip", "deg"),
    ("position_error_mean_cm", "mean", "joint centres", "cm"),
)


def accuracy_verdict(errors: dict[str, ErrorTable], solutions: dict[str, Solution]) -> str:
    """Which method is best on observed joints, and where it is not; warns of a bad smoother."""
    found = [(where, unit, v) for where, unit, v in _judged(errors) if v]
    if not found:
        return ""
    where, unit, values = found[0]
    sentences = [_ranking(where, unit, values), *_exceptions(values, found[1:])]
    sentences += [
        _worse(name, basis, found)
        for name, basis in _filters_of_smoothers(solutions).items()
        if basis in errors and name in errors
    ]
    return " ".join(s for s in sentences if s)


def _judged(errors: dict[str, ErrorTable]) -> list[tuple[str, str, dict[str, float]]]:
    """Name, unit and finite errors by method of every measure."""
    out = []
    for metric, aggregate, where, unit in _JUDGED:
        values = {n: e.errors.get(metric, {}).get(aggregate, np.nan) for n, e in errors.items()}
        out.append((where, unit, {n: float(v) for n, v in values.items() if np.isfinite(v)}))
    return out


def _ranking(where: str, unit: str, values: dict[str, float]) -> str:
    if len(values) == 1:
        name, value = next(iter(values.items()))
        return f"{name}: mean error {value:.2f} {unit} on {where}."
    best = _best(values)
    least = min(values.values())
    others = {n: v for n, v in sorted(values.items(), key=lambda x: x[1]) if n not in best}
    if not others:
        return f"All methods are equally accurate on {where} ({least:.2f} {unit})."
    against = listed([f"{v:.2f} {unit} ({n})" for n, v in others.items()])
    names = listed(best)
    verb = "is" if len(best) == 1 else "are equally"
    rank = "best" if len(best) == 1 else "good and best"
    return f"{names} {verb} {rank} on {where}: mean error {least:.2f} {unit}, against {against}."


def _best(values: dict[str, float]) -> list[str]:
    least = min(values.values())
    return [n for n, v in values.items() if v * (1 - _EQUAL) <= least]


def _exceptions(
    values: dict[str, float], others: list[tuple[str, str, dict[str, float]]]
) -> list[str]:
    """Where a method that is not best by the first measure is better than those that are."""
    best = _best(values)
    out: dict[str, list[str]] = {}
    for where, unit, found in others:
        winners = _best(found)
        if not set(best) & set(winners) and len(found) > 1:
            rival = min(found[n] for n in best) if set(best) <= set(found) else np.nan
            text = f"{where} ({found[winners[0]]:.2f} against {rival:.2f} {unit})"
            out.setdefault(winners[0], []).append(text)
    return [f"{name} is better on {'; '.join(texts)}." for name, texts in out.items()]


def _filters_of_smoothers(solutions: dict[str, Solution]) -> dict[str, str]:
    """Smoothers by name, each with the filter it was made from: that of the same innovations."""
    out = {}
    for name, smoothed in solutions.items():
        if smoothed.method not in FILTER_OF:
            continue
        own = FILTER_OF[smoothed.method]
        for other, filtered in solutions.items():
            if filtered.method == own and filtered.statistics == smoothed.statistics:
                out[name] = other
                break
    return out


def _worse(name: str, basis: str, found: list[tuple[str, str, dict[str, float]]]) -> str:
    """A warning where a result is less accurate than the one it was made from."""
    texts = [
        f"{where} ({values[name]:.2f} against {values[basis]:.2f} {unit})"
        for where, unit, values in found
        if name in values and basis in values and values[name] * (1 - _EQUAL) > values[basis]
    ]
    if not texts:
        return ""
    return (
        f"{name} is less accurate than {basis}, which it was made from, on {'; '.join(texts)}: "
        "there, smoothing did harm."
    )


@dataclass(frozen=True)
class Coverage:
    """How often the truth lies inside the stated 95 % bands."""

    share: float
    """Of all degrees of freedom and frames [%]."""
    squared: float
    """Mean squared error over stated variance, per degree of freedom; honest: 1."""
    observed: float = np.nan
    """Share on observed joints alone [%]; NaN where there are none."""
    ratio: float = np.nan
    """Error of observed joints over what is stated; honest: 1."""

    @property
    def word(self) -> str:
        """The verdict in a word or two."""
        if self.share < _HONEST:
            return "over-confident"
        return "about right" if self.share <= _WIDE else "too cautious"


def coverages(solutions: dict[str, Solution], recording: Recording | None) -> dict[str, Coverage]:
    """By method, where it states a covariance that can be compared with the truth."""
    out: dict[str, Coverage] = {}
    if recording is None or recording.truth is None:
        return out
    for name, solution in solutions.items():
        try:
            squared = nees(solution, recording)
            share = 100 * float(coverage(solution, recording).mean())
        except InputError:
            continue
        finite = squared[np.isfinite(squared)]
        value = float(finite.mean()) if len(finite) else np.nan
        try:
            joints = joint_consistency(solution, recording)
            out[name] = Coverage(share, value, 100 * joints.coverage, joints.ratio)
        except InputError:
            out[name] = Coverage(share, value)
    return out


_MEANING = {
    "over-confident": "errors are larger than stated, do not rely on the bands",
    "about right": "the bands can be relied on",
    "too cautious": "errors are smaller than stated",
}


def uncertainty_verdict(found: dict[str, Coverage]) -> str:
    """What share of errors the 95 % bands cover, and what that means, one sentence a verdict."""
    sentences = []
    for word, meaning in _MEANING.items():
        alike = {name: c for name, c in found.items() if c.word == word}
        if not alike:
            continue
        shares = listed([f"{c.share:.0f} % ({name})" for name, c in alike.items()])
        sentences.append(
            f"{word.capitalize()}: the 95 % bands cover {shares} of the errors; {meaning}."
        )
    return " ".join(sentences)


def listed(names: list[str]) -> str:
    """Names as in a sentence: a, b and c."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def consistency_table(found: dict[str, Coverage]) -> Table | None:
    """The numbers behind the verdict."""
    rows = [
        Row(name, (f"{c.share:.1f} %", _percent(c.observed), number(c.ratio), number(c.squared),
                   c.word))
        for name, c in found.items()
    ]  # fmt: skip
    heads = (
        "Covariance", "inside 95 % bands", "observed joints alone",
        "observed joints: error / stated (honest: 1)", "squared error / variance (honest: 1)",
        "verdict",
    )  # fmt: skip
    return Table(heads, tuple(rows)) if rows else None


def _percent(value: float) -> str:
    return f"{value:.1f} %" if np.isfinite(value) else "\u2013"
