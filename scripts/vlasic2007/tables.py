"""The tables as text and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from vlasic2007.cells import METHODS
from vlasic2007.paper import COMBINATIONS, FRAMES_PER_SECOND, JOINTS, TABLE_1, mean_of_joints
from vlasic2007.results import Results, Row

Kind = Literal["folded", "unfolded"]
_HEADINGS: dict[Kind, str] = {
    "folded": "angle folded into 0 to 180 deg (main figures)",
    "unfolded": "angle unfolded, 0 to 360 deg (as the paper's seem to be)",
}
_PAPER = "Vlasic 2007"
_COLUMNS = ("sensors", "method", "seeds", *JOINTS, "mean", "observed", "frames/s")
NOTES = """\
Mean and standard deviation over time, pooled over seeds [deg], of the angle between the estimated
and true rotation of head, right upper arm and left thigh relative to the pelvis, whose pose is
given. "mean" is over the three joints, "observed" over all joints that the sensors observe (child
in parent). Frames/s: one process, without compilation. The paper's errors are against an optical
system on real motion of another person; ours against the simulation's truth."""


def text(results: Results) -> str:
    """All tables, for a terminal."""
    parts = [_progress(results), NOTES]
    for section in results.sections:
        rows = results.rows(section)
        for kind, heading in _HEADINGS.items():
            parts += ["", _title(section, rows, heading), *_aligned(_table(rows, kind))]
    return "\n".join(parts)


def markdown(results: Results, checks: Sequence[str]) -> str:
    """All tables and checks, as a page."""
    parts = ["# Table 1 of Vlasic 2007 beside ours", "", _progress(results), "", NOTES]
    for section in results.sections:
        rows = results.rows(section)
        for kind, heading in _HEADINGS.items():
            table = _table(rows, kind)
            ruler = ["---" if i < 2 else "---:" for i in range(len(_COLUMNS))]
            parts += ["", f"## {_title(section, rows, heading)}", ""]
            parts += [f"| {' | '.join(line)} |" for line in (table[0], ruler, *table[1:])]
    parts += ["", "## Ratios", "", "```", *checks, "```", ""]
    if results.cells:
        parts += ["![Bars: mean error by sensors and method](vlasic2007.png)", ""]
    return "\n".join(parts)


def _progress(results: Results) -> str:
    return f"{len(results.cells)} of {results.wanted} estimates are there."


def _title(section: tuple[str, str], rows: list[Row], heading: str) -> str:
    most = max(len(row.seeds) for row in rows)
    short = sum(len(row.seeds) < most for row in rows)
    note = f" ({short} rows have fewer)" if short else ""
    return f"{section[0]}, {section[1]}, {most} seed{'s' * (most != 1)}{note}: {heading}"


def _table(rows: list[Row], kind: Kind) -> list[tuple[str, ...]]:
    """Heading and lines; the paper's own line leads each combination."""
    lines = [_COLUMNS]
    for combination in COMBINATIONS:
        ours = [row for row in rows if row.combination == combination]
        if not ours:
            continue
        joints = [_pair(*moments) for moments in TABLE_1[combination]]
        lines.append((combination, _PAPER, "", *joints, f"{mean_of_joints(combination):.1f}", "",
                      f"{FRAMES_PER_SECOND:.0f}"))  # fmt: skip
        lines += [_line(row, kind) for row in ours]
    return lines


def _line(row: Row, kind: Kind) -> tuple[str, ...]:
    moments = row.folded if kind == "folded" else row.unfolded
    seeds = f"{len(row.seeds)}" + (f" ({row.failed} failed)" if row.failed else "")
    if not moments:
        return ("", METHODS[row.method], seeds, *["-"] * (len(JOINTS) + 3))
    mean = sum(m for m, _ in moments) / len(moments)
    return (
        "", METHODS[row.method], seeds, *[_pair(*m) for m in moments], _digits(mean),
        _digits(row.observed), f"{row.frames_per_second:.0f}",
    )  # fmt: skip


def _pair(mean: float, deviation: float) -> str:
    return f"{_digits(mean)} ± {_digits(deviation)}"


def _digits(value: float) -> str:
    """One decimal, two digits where the value is small; a dash for none."""
    if value != value:
        return "-"
    return f"{value:.1f}" if value >= 0.95 else f"{value:.2g}"


def _aligned(table: list[tuple[str, ...]]) -> list[str]:
    width = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  ".join(
            f"{cell:<{w}}" if i < 2 else f"{cell:>{w}}"
            for i, (cell, w) in enumerate(zip(line, width, strict=True))
        ).rstrip()
        for line in table
    ]
