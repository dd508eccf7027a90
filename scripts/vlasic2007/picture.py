"""Bars: mean error over the three joints, by sensors and method, beside the paper's."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vlasic2007.cells import METHODS
from vlasic2007.paper import COMBINATIONS, mean_of_joints
from vlasic2007.results import Results

_WIDTH = 0.16
_DPI = 110


def draw(results: Results, target: Path) -> Path:
    """Write the picture: a panel for each profile, of the first motion."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from mocap_jax.report.style import RC

    motion = results.sections[0][0]
    sections = [section for section in results.sections if section[0] == motion]
    with rc_context(RC):
        figure = Figure(figsize=(9.0, 0.5 + 2.7 * len(sections)), layout="constrained")
        panels = np.atleast_1d(figure.subplots(len(sections), 1, sharex=True))
        for axes, section in zip(panels, sections, strict=True):
            _panel(axes, results, section)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        figure.savefig(target, dpi=_DPI)
    return target


def _panel(axes, results: Results, section: tuple[str, str]) -> None:
    from mocap_jax.report.style import TRUTH, colours, quiet_grid

    palette = colours(list(METHODS))
    place = np.arange(len(COMBINATIONS))
    bars = [("Vlasic 2007, real motion (unfolded)", TRUTH, map(mean_of_joints, COMBINATIONS))]
    for method, name in METHODS.items():
        rows = [results.row(section, c, method) for c in COMBINATIONS]
        heights = (float("nan") if row is None else row.mean for row in rows)
        bars.append((name, palette[method], heights))
    for i, (name, colour, heights) in enumerate(bars):
        at = place + _WIDTH * (i - (len(bars) - 1) / 2)
        values = np.array(list(heights))
        axes.bar(at, values, 0.92 * _WIDTH, color=colour, label=name)
        for x, value in zip(at, values, strict=True):
            if np.isfinite(value):
                short = f"{value:.0f}" if value >= 9.95 else f"{value:.2g}"
                axes.annotate(short, (x, value), (0, 1), textcoords="offset points", ha="center",
                              va="bottom", size=6)  # fmt: skip
    axes.set_yscale("log")
    axes.set_ylim(top=400)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xticks(place, COMBINATIONS)
    axes.tick_params(axis="x", length=0, labelcolor="black")
    axes.set_ylabel("mean error, folded [deg]")
    seeds = max(len(row.seeds) for row in results.rows(section))
    axes.set_title(f"{section[0]}, profile {section[1]}, {seeds} seed{'s' * (seeds != 1)}: "
                   "neck, right shoulder, left hip relative to the pelvis")  # fmt: skip
    quiet_grid(axes)
