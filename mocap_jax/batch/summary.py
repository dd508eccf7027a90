"""`Summary`: what came of all jobs, as a table for people and files for programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_ERROR = "orientation_error_mean_deg"
_KINDS = ("mean_observed", "mean")
COLUMNS = (
    "name", "outcome", "status", "frames", "orientation_error_mean_deg", "seconds_solve",
    "seconds", "remarks", "failed", "source", "solution",
)  # fmt: skip
"""Of the table in CSV."""


@dataclass(frozen=True)
class Summary:
    """Records of all jobs of a batch."""

    records: tuple[dict[str, Any], ...]
    kept: frozenset[str]
    """Sources whose results were there already."""

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Records of jobs that gave no result."""
        return [r for r in self.records if r.get("failed")]

    @property
    def lossy(self) -> list[dict[str, Any]]:
        """Records of results made from damaged files."""
        return [r for r in self.records if not r.get("failed") and r.get("salvage")]

    def as_json(self) -> dict[str, Any]:
        """Counts, and the record of every job."""
        failed = len(self.failed)
        return {
            "recordings": len(self.records),
            "done": len(self.records) - failed - len(self._kept()),
            "already_done": len(self._kept()),
            "failed": failed,
            "salvaged": len(self.lossy),
            "results": [{**r, "outcome": self.outcome(r)} for r in self.records],
        }

    def outcome(self, record: dict[str, Any]) -> str:
        """In a word or two."""
        if record.get("failed"):
            return "failed"
        kept = "already done" if record["source"] in self.kept else "done"
        return f"{kept}, salvaged" if record.get("salvage") else kept

    def as_csv(self) -> str:
        """One row a recording, columns `COLUMNS`."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for r in self.records:
            row = {**r, "name": _name(r), "outcome": self.outcome(r), _ERROR: mean_error(r)}
            row["remarks"] = " ".join(r.get("remarks", ()))
            writer.writerow("" if row.get(c) is None else row[c] for c in COLUMNS)
        return stream.getvalue()

    def __str__(self) -> str:
        width = max([len(_name(r)) for r in self.records] + [9])
        columns = f"{'error [deg]':>11}  {'frames':>7}  {'solve [s]':>9}  outcome"
        head = f"{'recording':<{width}}  {columns}"
        lines = [head, "-" * len(head)]
        lines += [self._row(r, width) for r in self.records]
        counts = self.as_json()
        parts = [f"{counts['done']} done", f"{counts['already_done']} already done"]
        parts += [f"{counts['failed']} failed"]
        return "\n".join([*lines, "", f"{len(self.records)} recordings: {', '.join(parts)}"])

    def _row(self, record: dict[str, Any], width: int) -> str:
        error, frames = mean_error(record), record.get("frames")
        solve = record.get("seconds_solve")
        cells = (
            f"{_name(record):<{width}}",
            f"{'-' if error is None else f'{error:.2f}':>11}",
            f"{'-' if frames is None else frames:>7}",
            f"{'-' if solve is None else f'{solve:.1f}':>9}",
            self.outcome(record) + (f": {record['failed']}" if record.get("failed") else ""),
        )
        return "  ".join(cells)

    def _kept(self) -> Sequence[dict[str, Any]]:
        return [r for r in self.records if r["source"] in self.kept and not r.get("failed")]


def mean_error(record: dict[str, Any]) -> float | None:
    """Mean orientation error of the observed joints, or of all; None without truth [deg]."""
    table = (record.get("errors") or {}).get(_ERROR, {})
    return next((table[kind] for kind in _KINDS if table.get(kind) is not None), None)


def _name(record: dict[str, Any]) -> str:
    return Path(record["source"]).stem
