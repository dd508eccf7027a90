"""Rows of the report's tables, as text ready for the page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_jax.metrics import ErrorTable
from mocap_jax.recording import Recording
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

# Kind of calibration value: heading, factor and unit for people.
_CALIBRATION = {
    "gyroscope_bias": ("Gyroscope offset", 180 / np.pi, "deg/s"),
    "accelerometer_bias": ("Accelerometer offset", 1.0, "m/s\u00b2"),
    "mounting_rotation": ("Mounting rotation", 180 / np.pi, "deg"),
    "mounting_offset": ("Mounting offset", 1e3, "mm"),
    "segment_length": ("Segment length, change", 100.0, "%"),
    "source_position": ("Source position, change", 1e3, "mm"),
    "speed_of_sound": ("Speed of sound, change", 100.0, "%"),
    "source_offset": ("Constant error of a source's distances", 1e3, "mm"),
}

_OWNERS = {
    "segment_length": "Segment",
    "source_position": "Source",
    "source_offset": "Source",
    "speed_of_sound": "",
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


def _compared(head: str, values: list[float], **marks: bool) -> Row:
    finite = [v if np.isfinite(v) else np.inf for v in values]
    # Only a difference that matters is pointed out.
    apart = len(values) > 1 and min(finite) < 0.99 * max(finite)
    best = int(np.argmin(finite)) if apart else -1
    return Row(head, tuple(number(v) for v in values), best, **marks)


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


def calibration_tables(
    solutions: dict[str, Solution], recording: Recording | None
) -> dict[str, Table]:
    """Estimated constants of the sensors with their standard deviations, by heading."""
    truth = dict(recording.truth.parameters) if recording and recording.truth else {}
    out = {}
    for method, solution in solutions.items():
        kinds = list(dict.fromkeys(key.split("/", 1)[0] for key in solution.calibration))
        for kind in kinds:
            title, factor, unit = _CALIBRATION.get(kind, (kind.replace("_", " "), 1.0, ""))
            rows = [
                _calibration_row(key, solution, truth, factor)
                for key in solution.calibration
                if key.split("/", 1)[0] == kind
            ]
            owner = _OWNERS.get(kind, "Sensor")
            heads: tuple[str, ...] = (owner, "estimate", "standard deviation", "truth")
            known = any(r.cells[2] != "\u2013" for r in rows)
            if not known:
                heads = heads[:3]
                rows = [Row(r.head, r.cells[:2]) for r in rows]
            out[f"{title}, {method}" + (f" [{unit}]" if unit else "")] = Table(heads, tuple(rows))
    return out


def _calibration_row(key: str, solution: Solution, truth: dict, factor: float) -> Row:
    def shown(values: dict) -> str:
        if key not in values:
            return "\u2013"
        flat = np.ravel(np.asarray(values[key], float)) * factor
        return "  ".join(f"{v:+.3f}" if values is not solution.calibration_std else f"{v:.3f}"
                         for v in flat)  # fmt: skip

    cells = (shown(solution.calibration), shown(solution.calibration_std), shown(truth))
    return Row(key.split("/", 1)[-1], cells)
