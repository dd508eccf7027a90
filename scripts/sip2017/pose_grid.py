"""Poses of several estimates of one recording, a row each, over the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mocap_jax as mj
from mocap_jax.metrics.align import align
from mocap_jax.report.stick import Bones, View, bones, draw_bones, draw_lines, facing, view_from
from mocap_jax.report.style import INK, MUTED, TRUTH
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import root_segment, segment_poses

_LABEL = 0.9
"""Room on the left for the rows' names, in widths of a cell."""


@dataclass(frozen=True)
class Row:
    """Poses at the chosen moments."""

    label: str
    colour: str
    shapes: list[Bones]
    ghosts: list[Bones]
    """The true ones, on the same root; none for the row of the truth itself."""
    roots: np.ndarray


def draw_grid(
    solutions: dict[str, tuple[mj.Solution, str]],
    recording: mj.Recording,
    times: Sequence[float],
    file: Path,
    *,
    truth: bool = True,
    turn: float = 0.7,
    captions: Sequence[str] | None = None,
) -> Path:
    """Draw estimates beside each other.

    Args:
        solutions: estimate and colour by the name of its row.
        recording: with its truth.
        times: moments [s], a column each.
        file: PNG to write.
        truth: a row of the true poses above the others.
        turn: of the viewer from the front, to the person's left [rad].
        captions: of the columns; default the times.
    """
    rows = [_row(name, *estimate, recording, times) for name, estimate in solutions.items()]
    if truth:
        first = rows[0]
        rows.insert(0, Row("truth", "#6b7785", first.ghosts, [], first.roots))
    view = view_from(_facing(next(iter(solutions.values()))[0], recording), turn)
    words = captions or [f"{t - recording.setup.score_from:.1f} s" for t in times]
    return _drawn(rows, words, view, file)


def _row(
    label: str, solution: mj.Solution, colour: str, recording: mj.Recording, times: Sequence[float]
) -> Row:
    pair = align(solution, recording, from_time=0.0)
    at = [int(np.argmin(np.abs(pair.time - t))) for t in times]
    R, p = segment_poses(pair.body, pair.q[at])
    R_true, p_true = segment_poses(pair.reference_body, pair.reference_q[at])
    # Poses, not drift: on the true root.
    roots = p_true[:, root_segment(pair.reference_body.topology)]
    p = p + (roots - p[:, root_segment(pair.body.topology)])[:, None]
    return Row(
        label, colour, _shapes(pair.body, R, p), _shapes(pair.reference_body, R_true, p_true), roots
    )


def _shapes(body: mj.Body, R: np.ndarray, p: np.ndarray) -> list[Bones]:
    frames = anatomical_frames(body)
    return [bones(body, R[k], p[k], frames) for k in range(len(R))]


def _facing(solution: mj.Solution, recording: mj.Recording) -> float:
    pair = align(solution, recording)
    some = pair.reference_q[:: max(1, len(pair.q) // 40)]
    return facing(pair.reference_body, segment_poses(pair.reference_body, some)[0])


def _drawn(rows: list[Row], words: Sequence[str], view: View, file: Path) -> Path:
    extents = [
        _extent(s, r, view) for row in rows for s, r in zip(row.shapes, row.roots, strict=True)
    ]
    low, high = min(e[0] for e in extents) - 0.1, max(e[1] for e in extents) + 0.16
    cell = max(0.6 * (high - low), 2 * max(e[2] for e in extents) + 0.1)
    columns, height = len(words), high - low
    wide, tall = (columns + _LABEL) * cell, len(rows) * height + 0.2
    size = 1.15 * (columns + _LABEL)
    figure = Figure(figsize=(size, size * tall / wide), dpi=110)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, wide)
    axes.set_ylim(-0.2, len(rows) * height)
    axes.set_axis_off()
    for number, row in enumerate(reversed(rows)):
        base = number * height
        axes.axhline(base + 0.06, color=INK, linewidth=0.6, alpha=0.2, zorder=0)
        axes.text(0.12 * cell, base + 0.5 * height, row.label, va="center", color=row.colour,
                  size=10, weight="bold")  # fmt: skip
        for k in range(columns):
            _draw_pose(axes, row, k, view, ((k + 0.5 + _LABEL) * cell, base - low))
    for k, word in enumerate(words):
        axes.text((k + 0.5 + _LABEL) * cell, -0.02, word, ha="center", va="top", color=MUTED,
                  size=9)  # fmt: skip
    figure.savefig(file, dpi=110)
    return file


def _draw_pose(axes: Axes, row: Row, k: int, view: View, place: tuple[float, float]) -> None:
    root = row.roots[k] * [1, 1, 0]
    if row.ghosts:
        draw_bones(axes, row.ghosts[k], root, view, place, TRUTH, 1.0, outline=False)
    draw_bones(axes, row.shapes[k], root, view, place, row.colour, 0.9, outline=True)
    if row.ghosts:
        draw_lines(axes, row.shapes[k], root, view, place, "white")
        draw_lines(axes, row.ghosts[k], root, view, place, INK)


def _extent(shape: Bones, root: np.ndarray, view: View) -> tuple[float, float, float]:
    """Lowest and highest coordinate in the picture, and farthest to a side [m]."""
    points = np.concatenate([shape.start, shape.end, shape.heads])
    x, y = (view.flat(points) - view.flat((root * [1, 1, 0])[None])).T
    return float(y.min()), float(y.max()), float(np.abs(x).max())
