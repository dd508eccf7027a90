"""Table 2 as text: the paper's line above ours, pooled over clips and seeds."""

from __future__ import annotations

import numpy as np

from sip2017.cells import Cell
from sip2017.rows import PAPER, ROWS

NOTES = """\
Orientation: angle of thighs and upper arms, whose boards were held out [deg]. Position: 13 joints
relative to the root's [cm]. Mean and standard deviation over all frames, clips and seeds (each clip
counts by its frames, the rest hold left out). The paper's errors are against a pose from all ten
sensors, ours against the simulation's truth. The pose prior never saw the subject. Every clip and
seed has its own errors. SOP has orientations alone, and where a board's is lost for a while the
prior; SIP has rates as well, which the paper's has not: SIP-AO is SIP without."""


def pooled(scores: list[dict], key: str) -> tuple[float, float]:
    """Mean and standard deviation over the frames of all cells."""
    weight = np.array([s["frames"] for s in scores], float)
    mean, deviation = np.array([s[key] for s in scores]).T
    weight /= weight.sum()
    total = float(weight @ mean)
    return total, float(np.sqrt(weight @ (deviation**2 + mean**2) - total**2))


def text(cells: list[tuple[Cell, dict]], wanted: int) -> str:
    """All tables, for a terminal and for a page."""
    lines = [f"{len(cells)} of {wanted} estimates are there.", "", NOTES, "", _HEAD]
    for row, what in ROWS.items():
        if row in PAPER:
            a, b, c, d = PAPER[row]
            lines.append(f"{row:<9} {'the paper':<38} {a:6.1f} ± {b:4.1f}   {c:5.1f} ± {d:4.1f}")
        usable = [s for cell, s in cells if cell.row == row and "orientation" in s]
        if usable:
            lines.append(_line("", what, usable, len(usable)))
        if usable and "unscaled" in usable[0]:
            inner = [s["unscaled"] | {"frames": s["frames"]} for s in usable]
            lines.append(_line("", "  its rotations on the right body", inner, len(usable)))
    return "\n".join([*lines, "", *_by_clip(cells), "", *ratios(cells)])


_HEAD = f"{'row':<9} {'':<38} {'orientation':>13}   {'position':>12}   estimates"


def _line(row: str, what: str, scores: list[dict], count: int) -> str:
    (a, b), (c, d) = pooled(scores, "orientation"), pooled(scores, "position")
    return f"{row:<9} {what:<38} {a:6.1f} ± {b:4.1f}   {c:5.1f} ± {d:4.1f}   {count}"


def _by_clip(cells: list[tuple[Cell, dict]]) -> list[str]:
    """Orientation / position of every clip, a column a row of the table."""
    rows = [row for row in ROWS if any(cell.row == row for cell, _ in cells)]
    lines = [f"{'clip':<22}" + "".join(f"{row:>14}" for row in rows)]
    for label in dict.fromkeys(cell.label for cell, _ in cells):
        line = f"{label:<22}"
        for row in rows:
            own = [s for c, s in cells if (c.label, c.row) == (label, row) and "orientation" in s]
            pair = (pooled(own, key)[0] for key in ("orientation", "position"))
            line += f"{'{:.1f}/{:.1f}'.format(*pair) if own else '-':>14}"
        lines.append(line)
    return lines


def ratios(cells: list[tuple[Cell, dict]]) -> list[str]:
    """SIP over SOP on the clips and seeds that both have, and the large body over the right one."""
    lines = []
    for one, other, paper in (
        ("SIP", "SOP", (0.68, 0.54)), ("SIP-AO", "SOP", (0.68, 0.54)),
        ("SIP-120", "SIP", (1.07, 1.44)), ("SIP-BW", "SIP", (1.01, 1.08)),
    ):  # fmt: skip
        pair = _common(cells, one, other)
        if pair is None:
            continue
        found = [pooled(pair[0], k)[0] / pooled(pair[1], k)[0] for k in ("orientation", "position")]
        lines.append(
            f"{one} / {other}: orientation {found[0]:.2f} (the paper {paper[0]:.2f}), "
            f"position {found[1]:.2f} ({paper[1]:.2f})"
        )
    return lines


def _common(
    cells: list[tuple[Cell, dict]], one: str, other: str
) -> tuple[list[dict], list[dict]] | None:
    by: dict[str, dict] = {one: {}, other: {}}
    for cell, scores in cells:
        if cell.row in by and "orientation" in scores:
            by[cell.row][cell.label, cell.seed] = scores
    shared = sorted(by[one].keys() & by[other].keys())
    return ([by[one][k] for k in shared], [by[other][k] for k in shared]) if shared else None
