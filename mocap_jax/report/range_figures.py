"""Ultrasonic distances by source and receiver: statistics as matrices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize, SymLogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FuncFormatter

from mocap_jax.report.statistic_streams import range_ends, range_pairs, unheard_pairs
from mocap_jax.report.style import EXCLUDED, INK, RC, plain_name
from mocap_jax.solution import Solution

# Fewer distances than this say nothing about a pair's error.
_FEW = 10
_HATCH: dict[str, Any] = {"facecolor": "white", "edgecolor": EXCLUDED, "hatch": "////", "lw": 0.0}


@dataclass(frozen=True)
class _Panel:
    """One matrix: what it shows and how."""

    title: str
    scale: str
    """Label of the colour scale."""
    value: Callable[[dict[str, float]], float]
    colours: str
    norm: Normalize
    ticks: tuple[float, ...]
    form: str
    notable: float
    """Size from which on a cell has its number written in it."""
    dark: float
    """Size from which on that number is white."""


_PANELS = (
    _Panel("Distances used", "number used", lambda r: r.get("count", np.nan), "Blues",
           Normalize(0.0), (), ".0f", np.inf, np.inf),
    _Panel("Bias", "mean of measured minus predicted [mm]",
           lambda r: 1e3 * r.get("bias_units", np.nan), "RdBu_r",
           SymLogNorm(30.0, vmin=-300.0, vmax=300.0), (-300, -100, -30, 0, 30, 100, 300), "+.0f",
           20.0, 100.0),
    _Panel("RMS", "root mean square of measured minus predicted [mm]",
           lambda r: 1e3 * r.get("rms_units", np.nan), "YlGnBu", LogNorm(3.0, 600.0),
           (3, 10, 30, 100, 300), ".0f", 50.0, 90.0),
    _Panel("Outliers", "share of those used that lost weight [%]",
           lambda r: 100.0 * r.get("lowered", np.nan), "OrRd", Normalize(0.0, 100.0),
           (0, 25, 50, 75, 100), ".0f", 10.0, 60.0),
)  # fmt: skip


def range_matrices(solution: Solution) -> Figure | None:
    """Number, bias, RMS and outliers of every source-receiver pair; None without ranges.

    Pairs that cannot hear each other are grey; numbers stand only where a value is notable.
    """
    pairs = range_pairs(solution)
    if not pairs:
        return None
    sources, receivers = range_ends(solution)
    unheard = unheard_pairs(solution)
    excluded = np.array([[(s, r) in unheard for s in sources] for r in receivers])
    count = np.array([
        [pairs.get((s, r), {}).get("count", 0.0) for s in sources] for r in receivers
    ])  # fmt: skip
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 2 * (0.235 * len(receivers) + 1.1) + 0.7),
                        layout="constrained")  # fmt: skip
        axes = figure.subplots(2, 2, sharex=True, sharey=True, squeeze=False)
        for axis, panel in zip(axes.flat, _PANELS, strict=True):
            cells = np.array([
                [panel.value(pairs[s, r]) if (s, r) in pairs else np.nan for s in sources]
                for r in receivers
            ])  # fmt: skip
            few = (count < _FEW) & (panel is not _PANELS[0]) & ~excluded
            _matrix(figure, axis, panel, np.where(excluded | few, np.nan, cells))
            _fill(axis, few, _HATCH)
            _fill(axis, excluded, {"color": EXCLUDED, "lw": 0.0})
        _name_ends(axes, sources, receivers)
        _explain_fills(figure)
    return figure


def _matrix(figure: Figure, axis: Axes, panel: _Panel, cells: np.ndarray) -> None:
    norm = panel.norm
    if norm.vmax is None:
        norm = Normalize(0.0, float(max(np.nanmax(cells, initial=0.0), 1.0)))
    image = axis.imshow(cells, cmap=panel.colours, norm=norm, aspect="auto")
    for row, column in zip(*np.nonzero(np.abs(cells) >= panel.notable), strict=True):
        x = cells[row, column]
        text = format(x, panel.form) if abs(x) < 1000 else f"{x / 1000:.1f}k"
        axis.text(column, row, text, ha="center", va="center", size=8.0,
                  color="white" if abs(x) > panel.dark else INK)  # fmt: skip
    axis.set_title(panel.title)
    bar = figure.colorbar(image, ax=axis, pad=0.015, aspect=28, label=panel.scale)
    if panel.ticks:
        bar.set_ticks(panel.ticks)
        bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        bar.ax.minorticks_off()
    bar.outline.set_visible(False)
    _quiet_cells(axis, cells.shape)


def _fill(axis: Axes, chosen: np.ndarray, look: dict[str, Any]) -> None:
    """Cells that hold no value."""
    for row, column in zip(*np.nonzero(chosen), strict=True):
        axis.add_patch(Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, **look))


def _quiet_cells(axis: Axes, shape: tuple[int, ...]) -> None:
    """White lines between cells, none around."""
    axis.set_xticks(np.arange(shape[1] + 1) - 0.5, minor=True)
    axis.set_yticks(np.arange(shape[0] + 1) - 0.5, minor=True)
    axis.grid(visible=False)
    axis.grid(visible=True, which="minor", color="white", lw=1.0)
    axis.tick_params(which="both", length=0)
    axis.spines[:].set_visible(False)


def _name_ends(axes: np.ndarray, sources: list[str], receivers: list[str]) -> None:
    """Sources beneath every matrix, receivers beside the left ones."""
    for axis in axes.flat:
        axis.tick_params(labelbottom=True)
        axis.set_xticks(range(len(sources)), [plain_name(s) for s in sources], rotation=40,
                        ha="right", rotation_mode="anchor", size=8.5)  # fmt: skip
    for axis in axes[:, 0]:
        axis.set_yticks(range(len(receivers)), [plain_name(r) for r in receivers], size=8.5)


def _explain_fills(figure: Figure) -> None:
    figure.legend(
        handles=[
            Patch(color=EXCLUDED, label="cannot hear each other (no fault)"),
            Patch(**_HATCH, label=f"fewer than {_FEW} used: too few to judge"),
        ],
        loc="outside upper right", ncols=2,
    )  # fmt: skip
