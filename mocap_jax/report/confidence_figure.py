"""Confidence of ultrasonic distances over time, by source and receiver."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch

from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.recording import RangeStream, Recording
from mocap_jax.report.style import EXCLUDED, MUTED, RC, plain_name

# An obstructed path is the normal case, no fault: pale, not red.
_CONFIDENCE = LinearSegmentedColormap.from_list(
    "confidence", ["#f8e3c4", "#e9d9cf", "#a9c6ea", "#5b93df", "#1f5bc4"]
)
_BINS = 120


def confidence_figure(
    recording: Recording, unheard: frozenset[tuple[str, str]] = frozenset()
) -> Figure | None:
    """Confidence of every source-receiver pair over time, one panel a source (Vlasic 2007, fig. 5).

    None without ranges.

    Args:
        recording: the measurements.
        unheard: pairs (source, receiver) that cannot hear each other, drawn grey.
    """
    ranges = recording.ranges
    if ranges is None or not len(ranges.time):
        return None
    time = np.asarray(ranges.time)
    edges = np.linspace(time[0], time[-1] + 1e-9, min(_BINS, max(len(time) // 200, 20)) + 1)
    grid = _mean_confidence(ranges, edges)
    shown = [r for r in range(grid.shape[1]) if np.isfinite(grid[:, r]).any()]
    across = 2 if len(grid) > 1 else 1
    down = -(-len(grid) // across)
    with rc_context(RC):
        figure = Figure(
            figsize=(10.5, down * (0.15 * len(shown) + 0.42) + 0.9), layout="constrained"
        )
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for panel, cells, name in zip(panels.flat, grid, ranges.source_names, strict=False):
            source = name.removeprefix(SOURCE_PREFIX)
            grey = [(source, ranges.receiver_names[r]) in unheard for r in shown]
            image = _panel(panel, cells[shown], np.array(grey), edges)
            panel.set_title(f"source {plain_name(source)}", size=9.5)
        names = [plain_name(ranges.receiver_names[r]) for r in shown]
        for panel in panels[:, 0]:
            panel.set_yticks(range(len(shown)), names, size=7.5)
        for panel in panels.flat[len(grid) :]:
            panel.set_axis_off()
        for panel in panels[-1]:
            panel.set_xlabel("time [s]", color=MUTED)
        bar = figure.colorbar(image, ax=panels, shrink=0.4, pad=0.01, aspect=30)
        bar.set_ticks([0.0, 0.5, 1.0], labels=["0: path\nobstructed", "0.5", "1: clear"])
        bar.outline.set_visible(False)
        figure.legend(handles=_fills(any(unheard)), loc="outside upper right", ncols=2)
    return figure


def _panel(panel: Axes, cells: np.ndarray, grey: np.ndarray, edges: np.ndarray) -> AxesImage:
    image = panel.imshow(
        np.where(grey[:, None], np.nan, cells), cmap=_CONFIDENCE, vmin=0.0, vmax=1.0,
        aspect="auto", interpolation="nearest",
        extent=(edges[0], edges[-1], len(cells) - 0.5, -0.5),
    )  # fmt: skip
    for row in np.flatnonzero(grey):
        panel.axhspan(row - 0.5, row + 0.5, color=EXCLUDED, lw=0)
    panel.set_yticks(np.arange(len(cells) + 1) - 0.5, minor=True)
    panel.grid(visible=False)
    panel.grid(visible=True, which="minor", axis="y", color="white", lw=0.8)
    panel.tick_params(which="both", length=0)
    panel.spines[:].set_visible(False)
    return image


def _fills(excluded: bool) -> list[Patch]:
    """Entries of the legend for what is no confidence."""
    blank = Patch(facecolor="white", edgecolor=MUTED, lw=0.6, label="nothing received")
    grey = Patch(color=EXCLUDED, label="cannot hear each other (no fault)")
    return [grey, blank] if excluded else [blank]


def _mean_confidence(ranges: RangeStream, edges: np.ndarray) -> np.ndarray:
    """Mean confidence (sources, receivers, bins); NaN where nothing was received."""
    shape = (len(ranges.source_names), len(ranges.receiver_names), len(edges) - 1)
    column = np.clip(np.searchsorted(edges, np.asarray(ranges.time), "right") - 1, 0, shape[2] - 1)
    at = np.ravel_multi_index(
        (np.asarray(ranges.source), np.asarray(ranges.receiver), column), shape
    )
    size = int(np.prod(shape))
    count = np.bincount(at, minlength=size)
    total = np.bincount(at, np.asarray(ranges.confidence), minlength=size)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(shape)
