"""Ultrasonic distances by source and receiver: statistics as matrices, confidence over time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize, SymLogNorm
from matplotlib.figure import Figure

from mocap_jax.recording import Recording
from mocap_jax.report.statistic_streams import range_ends, range_pairs
from mocap_jax.report.style import INK, MUTED, RC, plain_name
from mocap_jax.solution import Solution

_Value = Callable[[dict[str, float]], float]


def _unused(row: dict[str, float]) -> float:
    """Share [%] of heard ranges that were not used or lost most of their weight."""
    used = 1.0 - row.get("rejected", 0.0)
    return 100.0 * (1.0 - used * (1.0 - row.get("lowered", 0.0)))


# Title, value of a pair, colours, normalisation, how a cell is written, where text turns white.
_PANELS: tuple[tuple[str, _Value, str, Normalize, str, float], ...] = (
    ("Used (number)", lambda r: r.get("count", np.nan), "Greys", Normalize(0, 400), ".0f", 260.0),
    ("Bias [mm]", lambda r: 1e3 * r.get("bias_units", np.nan), "RdBu_r",
     SymLogNorm(10.0, vmin=-300.0, vmax=300.0), "+.0f", 100.0),
    ("RMS [mm]", lambda r: 1e3 * r.get("rms_units", np.nan), "YlGnBu", LogNorm(3.0, 600.0), ".0f",
     90.0),
    ("Discounted [%]", _unused, "OrRd", Normalize(0.0, 100.0), ".0f", 60.0),
)  # fmt: skip


def range_matrices(solution: Solution) -> Figure | None:
    """Number, bias, RMS and discounted share of every source-receiver pair; None without ranges."""
    pairs = range_pairs(solution)
    if not pairs:
        return None
    sources, receivers = range_ends(solution)
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 0.2 * len(receivers) + 1.3), layout="constrained")
        panels = figure.subplots(1, len(_PANELS), sharey=True, squeeze=False)[0]
        for panel, (title, value, colours, norm, form, dark) in zip(panels, _PANELS, strict=True):
            cells = np.array([
                [value(pairs[s, r]) if (s, r) in pairs else np.nan for s in sources]
                for r in receivers
            ])  # fmt: skip
            panel.imshow(cells, cmap=colours, norm=norm, aspect="auto")
            _write_cells(panel, cells, form, dark)
            panel.set_xticks(range(len(sources)), [plain_name(s) for s in sources], rotation=60,
                             ha="right", rotation_mode="anchor", size=7.5)  # fmt: skip
            panel.set_yticks(range(len(receivers)), [plain_name(r) for r in receivers], size=8)
            panel.set_title(title)
            _quiet(panel)
    return figure


def _write_cells(panel: Axes, cells: np.ndarray, form: str, dark: float) -> None:
    for row, column in zip(*np.nonzero(np.isfinite(cells)), strict=True):
        x = cells[row, column]
        text = format(x, form) if abs(x) < 1000 else f"{x / 1000:.1f}k"
        panel.text(column, row, text, ha="center", va="center", size=6.5,
                   color="white" if abs(x) > dark else INK)  # fmt: skip


def _quiet(panel: Axes) -> None:
    panel.grid(visible=False)
    panel.tick_params(length=0)
    panel.spines[:].set_visible(False)


_CONFIDENCE = LinearSegmentedColormap.from_list(
    "confidence", ["#c23b4b", "#f0b48a", "#e8eef4", "#7fb0e6", "#2f6fde"]
)
_BINS = 240


def confidence_figure(recording: Recording) -> Figure | None:
    """Confidence of every source-receiver pair over time, one panel a source (Vlasic 2007, fig. 5).

    None without ranges.
    """
    ranges = recording.ranges
    if ranges is None or not len(ranges.time):
        return None
    time = np.asarray(ranges.time)
    edges = np.linspace(time[0], time[-1] + 1e-9, min(_BINS, max(len(time) // 200, 20)) + 1)
    grid = _mean_confidence(recording, edges)
    shown = [r for r in range(grid.shape[1]) if np.isfinite(grid[:, r]).any()]
    across = 2 if len(grid) > 1 else 1
    down = -(-len(grid) // across)
    with rc_context(RC):
        figure = Figure(
            figsize=(12.5, down * (0.115 * len(shown) + 0.42) + 0.5), layout="constrained"
        )
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        names = [plain_name(ranges.receiver_names[r]) for r in shown]
        for panel, cells, name in zip(panels.flat, grid, ranges.source_names, strict=False):
            image = panel.imshow(cells[shown], cmap=_CONFIDENCE, vmin=0.0, vmax=1.0, aspect="auto",
                                 extent=(edges[0], edges[-1], len(shown) - 0.5, -0.5),
                                 interpolation="nearest")  # fmt: skip
            panel.set_title(f"source {plain_name(name.removeprefix('source/'))}", size=9)
            panel.set_yticks(range(len(shown)), names, size=6.5)
            _quiet(panel)
        for panel in panels.flat[len(grid) :]:
            panel.set_axis_off()
        for panel in panels[-1]:
            panel.set_xlabel("time [s]", color=MUTED)
        figure.colorbar(image, ax=panels, shrink=0.5, pad=0.01, aspect=30, label="confidence")
    return figure


def _mean_confidence(recording: Recording, edges: np.ndarray) -> np.ndarray:
    """Mean confidence (sources, receivers, bins); NaN where nothing was received."""
    ranges = recording.ranges
    assert ranges is not None
    shape = (len(ranges.source_names), len(ranges.receiver_names), len(edges) - 1)
    column = np.clip(np.searchsorted(edges, np.asarray(ranges.time), "right") - 1, 0, shape[2] - 1)
    at = np.ravel_multi_index(
        (np.asarray(ranges.source), np.asarray(ranges.receiver), column), shape
    )
    size = int(np.prod(shape))
    count = np.bincount(at, minlength=size)
    total = np.bincount(at, np.asarray(ranges.confidence), minlength=size)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(shape)
