"""`ErrorTable`: errors by metric and joint, as numbers, tables and text."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas
    import xarray

AGGREGATES = ("mean", "mean_observed", "mean_table1")

# Metric, heading of the text table. Units stand in both.
_COLUMNS = (
    ("orientation_error_mean_deg", "joint [deg]"),
    ("orientation_error_rmse_deg", "joint rms [deg]"),
    ("segment_orientation_error_mean_deg", "segment [deg]"),
    ("position_error_mean_cm", "position [cm]"),
)
_WIDEST = "mean of observed joints"
_TABLE1_COLUMNS = (
    ("root_relative_orientation_error_mean_deg", "mean [deg]"),
    ("root_relative_orientation_error_std_deg", "std [deg]"),
)


@dataclass(frozen=True)
class ErrorTable:
    """Errors of an estimate against a reference.

    Keys of `errors[metric]` are child segment names (angles: `<segment>/<angle>`) and the
    aggregates `mean`, `mean_observed`, `mean_table1`; every metric's name ends in its unit.
    """

    errors: dict[str, dict[str, float]]
    observed: tuple[str, ...]
    """Segments whose joint the used sensors observe."""
    table1: tuple[str, ...]
    """Segments of Vlasic 2007, table 1, that the body has (relative to the root segment)."""
    frames: int
    """How many frames were scored."""
    interval: tuple[float, float]
    """First and last time scored [s]."""
    root: str = "Pelvis"
    """Name of the root segment."""

    def __getitem__(self, metric: str) -> dict[str, float]:
        """Errors of one metric by joint."""
        return self.errors[metric]

    def to_dataframe(self) -> pandas.DataFrame:
        """One row a joint, angle or aggregate; one column a metric; NaN where it has none."""
        import pandas

        table = pandas.DataFrame({m: pandas.Series(v, dtype=float) for m, v in self.errors.items()})
        ordered = list(dict.fromkeys(name for values in self.errors.values() for name in values))
        table = table.reindex(ordered)
        table.index.name = "joint"
        table.attrs["units"] = {metric: unit_of(metric) for metric in self.errors}
        return table

    def to_xarray(self) -> xarray.Dataset:
        """The same numbers over the dimension `joint`, units in the attributes."""
        import xarray

        table = self.to_dataframe()
        return xarray.Dataset(
            {m: ("joint", table[m].to_numpy(), {"units": unit_of(m)}) for m in self.errors},
            {"joint": list(table.index)},
            {"frames": self.frames, "observed": list(self.observed)},
        )

    def __str__(self) -> str:
        joints = [n for n in self.errors["orientation_error_mean_deg"] if n not in AGGREGATES]
        rest = [n for n in joints if n not in self.observed]
        blocks = [
            f"Mean errors over {self.frames} frames, {self.interval[0]:.2f} s to "
            f"{self.interval[1]:.2f} s\n(joint: rotation of child in parent; segment: rotation in "
            f"the world; position: joint centre)"
        ]
        if self.observed:
            rows = [*[n for n in joints if n in self.observed], "mean_observed"]
            blocks.append(self._block("Observed joints", rows, _COLUMNS))
        if self.table1:
            title = f"Relative to {self.root}"
            blocks.append(self._block(title, [*self.table1, "mean"], _TABLE1_COLUMNS))
        title = "All joints" if not self.observed else "Other joints"
        blocks.append(self._block(title, [*rest, "mean"], _COLUMNS))
        return "\n\n".join(blocks)

    def _block(self, title: str, rows: list[str], columns: tuple[tuple[str, str], ...]) -> str:
        label = {"mean_observed": _WIDEST, "mean": "mean of these"}
        if columns is _COLUMNS:
            label["mean"] = "mean of all joints"
        width = max(len(n) for n in (*self.errors["orientation_error_mean_deg"], _WIDEST))
        head = f"{title:<{width}}" + "".join(f"  {heading:>15}" for _, heading in columns)
        lines = [head, "-" * len(head)]
        for row in rows:
            values = [self.errors.get(metric, {}).get(row, math.nan) for metric, _ in columns]
            cells = "".join(f"  {_number(v):>15}" for v in values)
            lines.append(f"{label.get(row, row):<{width}}{cells}")
        return "\n".join(lines)


def unit_of(metric: str) -> str:
    """Unit that a metric's name ends in."""
    return {"deg": "deg", "cm": "cm"}.get(metric.rsplit("_", 1)[-1], "1")


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3f}"
