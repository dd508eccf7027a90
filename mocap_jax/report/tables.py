"""Rows of the report's tables, as text ready for the page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_jax.metrics import ErrorTable
from mocap_jax.report.statistic_streams import KINDS, sensors_of
from mocap_jax.solution import Solution

_HEADLINES = (
    ("Observed joints [deg]", "orientation_error_mean_deg", "mean_observed"),
    ("Neck, right shoulder, left hip (table 1) [deg]", "orientation_error_mean_deg", "mean_table1"),
    ("All joints [deg]", "orientation_error_mean_deg", "mean"),
    ("Segments, in the world [deg]", "segment_orientation_error_mean_deg", "mean"),
    ("Joint centres, from the root [cm]", "position_error_mean_cm", "mean"),
)

_TABLE1_NAMES = {
    "Head": "neck",
    "RightUpperArm": "right shoulder",
    "LeftUpperLeg": "left hip",
}


@dataclass(frozen=True)
class Row:
    """One line of a table."""

    head: str
    cells: tuple[str, ...]
    best: int = -1
    """Which cell to point out; -1 for none."""
    strong: bool = False
    """Set apart: an aggregate."""
    marked: bool = False
    """An observed joint."""
    off: tuple[int, ...] = ()
    """Cells that lie too far from the truth."""


@dataclass(frozen=True)
class Table:
    """A table of the page."""

    heads: tuple[str, ...]
    rows: tuple[Row, ...]


def number(value: float) -> str:
    """A number for the page, to at least three digits; a dash where there is none."""
    if not np.isfinite(value):
        return "\u2013"
    if abs(value) >= 1e4:
        return f"{value:.2e}"
    return f"{value:.3f}" if abs(value) < 1 else f"{value:.2f}"


def _compared(head: str, values: list[float], *, strong: bool = False, marked: bool = False) -> Row:
    finite = [v if np.isfinite(v) else np.inf for v in values]
    # Only a difference that matters is pointed out.
    apart = len(values) > 1 and min(finite) < 0.99 * max(finite)
    best = int(np.argmin(finite)) if apart else -1
    return Row(head, tuple(number(v) for v in values), best, strong, marked)


def headline_table(errors: dict[str, ErrorTable]) -> Table:
    """The means, one column a method."""
    rows = []
    for head, metric, aggregate in _HEADLINES:
        values = [e.errors.get(metric, {}).get(aggregate, np.nan) for e in errors.values()]
        if np.isfinite(values).any():
            rows.append(_compared(head, values))
    return Table(("Mean error", *errors), tuple(rows))


def joint_table(errors: dict[str, ErrorTable]) -> Table:
    """Orientation error of every joint, observed ones first, one column a method."""
    metric = "orientation_error_mean_deg"
    first = next(iter(errors.values()))
    observed = set(first.observed)
    names = list(dict.fromkeys(n for e in errors.values() for n in e[metric]))
    joints = [n for n in names if not n.startswith("mean")]
    order = [n for n in joints if n in observed]
    rows = [_joint_row(n, n, metric, errors, marked=True) for n in order]
    if order:
        rows.append(_joint_row("mean of observed joints", "mean_observed", metric, errors,
                               strong=True))  # fmt: skip
    rows += [_joint_row(n, n, metric, errors) for n in joints if n not in observed]
    rows.append(_joint_row("mean of all joints", "mean", metric, errors, strong=True))
    return Table(("Joint (child segment) [deg]", *errors), tuple(rows))


def root_table(errors: dict[str, ErrorTable]) -> Table | None:
    """The layout of Vlasic 2007, table 1: mean and standard deviation for each method."""
    shown = [n for n in next(iter(errors.values())).table1]
    if not shown:
        return None
    rows = []
    for method, table in errors.items():
        cells = []
        for name in (*shown, "mean"):
            for key in ("mean", "std"):
                metric = f"root_relative_orientation_error_{key}_deg"
                cells.append(number(table.errors.get(metric, {}).get(name, np.nan)))
        rows.append(Row(method, tuple(cells)))
    named = [_TABLE1_NAMES[n] for n in shown]
    heads = [f"{n}, {key}" for n in (*named, "together") for key in ("mean", "std")]
    return Table(("Relative to the root [deg]", *heads), tuple(rows))


def angle_table(errors: dict[str, ErrorTable]) -> Table | None:
    """RMSE of every named joint angle, one column a method."""
    metric = "joint_angle_rmse_deg"
    names = list(dict.fromkeys(n for e in errors.values() for n in e.errors.get(metric, {})))
    rows = [
        _joint_row(n.replace("_", " ").replace("/", ": "), n, metric, errors)
        for n in names
        if not n.startswith("mean")
    ]
    return Table(("Joint angle, RMS error [deg]", *errors), tuple(rows)) if rows else None


def _joint_row(
    head: str, name: str, metric: str, errors: dict[str, ErrorTable], **marks: bool
) -> Row:
    values = [e.errors.get(metric, {}).get(name, np.nan) for e in errors.values()]
    return _compared(head, values, **marks)


def residual_table(solutions: dict[str, Solution]) -> Table | None:
    """Whitened RMS and number of values of every sensor and kind, by method."""
    kinds = [k for k in KINDS if any(sensors_of(s, k) for s in solutions.values())]
    sensors = list(
        dict.fromkeys(n for k in kinds for s in solutions.values() for n in sensors_of(s, k))
    )
    rows = []
    for sensor in sensors:
        cells = []
        for kind in kinds:
            for solution in solutions.values():
                found = sensors_of(solution, kind).get(sensor, {})
                cells.append(number(found.get("rms", np.nan)))
                cells.append(f"{found['count']:.0f}" if "count" in found else "\u2013")
        rows.append(Row(sensor, tuple(cells)))
    heads = [
        text
        for kind in kinds
        for method in solutions
        for text in (f"{kind}, {method}: RMS", "values")
    ]
    return Table(("Sensor", *heads), tuple(rows)) if rows else None
