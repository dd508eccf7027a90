"""Tables of estimated constants: each beside its stated standard deviation and its true value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_jax.recording import Recording
from mocap_jax.report.constant_truth import Values, constant_truth
from mocap_jax.report.tables import Row, Table
from mocap_jax.report.verdicts import listed
from mocap_jax.solution import Solution
from mocap_jax.solution.methods import FILTERS

# Beyond this many stated standard deviations from the truth a value is marked.
_LIMIT = 3.0
# A larger share of marked values means that deviations are too small (honest: 0.3 %).
_TOLERATED = 0.02
_DASH = "\u2013"


@dataclass(frozen=True)
class _Kind:
    """How people are shown one kind of constant."""

    title: str
    factor: float
    unit: str
    digits: int
    owner: str = "Sensor"


_KINDS = {
    "gyroscope_bias": _Kind("Gyroscope offset", 180 / np.pi, "deg/s", 3),
    "accelerometer_bias": _Kind("Accelerometer offset", 1.0, "m/s\u00b2", 3),
    "mounting_rotation": _Kind("Mounting rotation", 180 / np.pi, "deg", 2),
    "mounting_offset": _Kind("Mounting offset", 1e3, "mm", 1),
    "accelerometer_scale": _Kind("Accelerometer scale error", 100.0, "%", 2),
    "gyroscope_scale": _Kind("Gyroscope scale error", 100.0, "%", 2),
    "clock_offset": _Kind("Clock offset", 1e3, "ms", 2),
    "heading": _Kind("Heading of measured orientations", 180 / np.pi, "deg", 2),
    "gyroscope_bias_walk": _Kind("Gyroscope offset over time", 180 / np.pi, "deg/s", 3),
    "accelerometer_bias_walk": _Kind("Accelerometer offset over time", 1.0, "m/s\u00b2", 3),
    "segment_length": _Kind("Segment length, change", 100.0, "%", 2, "Segment"),
    "source_position": _Kind("Source position, change", 1e3, "mm", 1, "Source"),
    "speed_of_sound": _Kind("Speed of sound, change", 100.0, "%", 3, "In"),
    "source_offset": _Kind("Constant error of a source's distances", 1e3, "mm", 1, "Source"),
}


@dataclass(frozen=True)
class ConstantTable:
    """One kind of constant by one method."""

    title: str
    table: Table
    far: int
    """Values further than three stated standard deviations from the truth."""
    known: int
    """Values with a truth and a standard deviation."""

    @property
    def verdict(self) -> str:
        """How many values are marked, in words; empty without truth."""
        if not self.known:
            return ""
        return f"{self.far} of {self.known} values beyond 3 standard deviations of the truth"


def constant_tables(
    solutions: dict[str, Solution], recording: Recording | None
) -> dict[str, list[ConstantTable]]:
    """Tables by method; filters of the same rest hold have theirs together."""
    out: dict[str, list[ConstantTable]] = {}
    for names, solution in _distinct(solutions):
        truth = constant_truth(solution, recording)
        kinds = dict.fromkeys(key.split("/", 1)[0] for key in solution.calibration)
        label = listed(names)
        out[f"Rest hold of {label}" if solution.method in FILTERS else label] = [
            _table(kind, solution, truth) for kind in kinds
        ]
    return out


def constants_verdict(tables: dict[str, list[ConstantTable]]) -> str:
    """How many of all constants lie too far from their true values, by method."""
    counts = {n: (sum(t.far for t in f), sum(t.known for t in f)) for n, f in tables.items()}
    counts = {n: (far, known) for n, (far, known) in counts.items() if known}
    if not counts:
        return ""
    shares = listed([f"{far} of {known} ({name})" for name, (far, known) in counts.items()])
    small = [name for name, (far, known) in counts.items() if far > _TOLERATED * known]
    after = (
        f"The deviations stated by {listed(small)} are too small."
        if small
        else "The stated deviations can be relied on."
    )
    return f"Further than three stated standard deviations from the truth: {shares}. {after}"


def _distinct(solutions: dict[str, Solution]) -> list[tuple[list[str], Solution]]:
    """Solutions with constants, those of filters that took over the same ones under all names."""
    out: list[tuple[list[str], Solution]] = []
    for name, solution in solutions.items():
        if not solution.calibration:
            continue
        same = [n for n, s in out if _same_rest_hold(s, solution)]
        if same:
            same[0].append(name)
        else:
            out.append(([name], solution))
    return out


def _same_rest_hold(a: Solution, b: Solution) -> bool:
    return (
        a.method in FILTERS
        and b.method in FILTERS
        and a.calibration.keys() == b.calibration.keys()
        and all(np.array_equal(a.calibration[k], b.calibration[k]) for k in a.calibration)
    )


def _table(kind: str, solution: Solution, truth: Values) -> ConstantTable:
    look = _KINDS.get(kind, _Kind(kind.replace("_", " "), 1.0, "", 3, "Of"))
    keys = [key for key in solution.calibration if key.split("/", 1)[0] == kind]
    known = any(key in truth for key in keys)
    rows, far, judged, width = [], 0, 0, 1
    for name, *numbers in (entry for key in keys for entry in _entries(key, solution, truth)):
        estimate, std, true = numbers
        width = max(width, len(estimate))
        off = np.abs(estimate - true) > _LIMIT * std
        far += int(off.sum())
        judged += int((np.isfinite(true) & np.isfinite(std)).sum())
        rows.append(_row(name, look, (estimate, std, true), off, known))
    title = f"{look.title} [{look.unit}]" if look.unit else look.title
    return ConstantTable(title, Table(_heads(look.owner, width, known), tuple(rows)), far, judged)


def _entries(
    key: str, solution: Solution, truth: Values
) -> list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Name, estimate, deviation and truth of each row of a constant: one, or one a knot."""
    whole = np.asarray(solution.calibration[key], float)
    flat = np.ravel(whole)
    std, true = (_like(x.get(key), flat) for x in (solution.calibration_std, truth))
    name = key.split("/", 1)[-1]
    if whole.ndim < 2:
        return [(name, flat, std, true)]
    apart = (x.reshape(whole.shape) for x in (flat, std, true))
    return [(f"{name}, knot {i + 1}", *rows) for i, rows in enumerate(zip(*apart, strict=True))]


def _like(values: object, estimate: np.ndarray) -> np.ndarray:
    """Values of the estimate's shape; NaN where there are none."""
    flat = np.ravel(np.asarray(values, float)) if values is not None else np.zeros(0)
    return flat if flat.shape == estimate.shape else np.full(estimate.shape, np.nan)


def _heads(owner: str, width: int, known: bool) -> tuple[str, ...]:
    axes = ("x", "y", "z") if width == 3 else ("estimate",) * width
    heads = [h for axis in axes for h in ((axis, "truth") if known else (axis,))]
    return (owner, *heads)


def _row(
    name: str,
    look: _Kind,
    numbers: tuple[np.ndarray, np.ndarray, np.ndarray],
    off: np.ndarray,
    known: bool,
) -> Row:
    cells: list[str] = []
    marked: list[int] = []
    for estimate, std, true, far in zip(*numbers, off, strict=True):
        if far:
            marked.append(len(cells))
        text = _signed(estimate, look)
        if np.isfinite(std):
            text += f" \u00b1 {std * look.factor:.{look.digits}f}"
        cells.append(text + (" *" if far else ""))
        if known:
            cells.append(_signed(true, look))
    return Row(name.replace("_", " "), tuple(cells), off=tuple(marked))


def _signed(value: float, look: _Kind) -> str:
    return f"{value * look.factor:+.{look.digits}f}" if np.isfinite(value) else _DASH
