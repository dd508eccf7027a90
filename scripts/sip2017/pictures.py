"""Figures 8 to 10 of the paper from our estimates: errors by clip, and over time."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np

from sip2017.cells import Cell
from sip2017.tables import pooled

matplotlib.use("Agg")
from matplotlib import pyplot as plt

_COLOURS = {"SOP": "#c0392b", "SIP-M": "#e0a800", "SIP-T1": "#7a4fa3", "SIP": "#1f6fb4",
            "SIP-AO": "#2a9d8f", "SIP-BW": "#6c8ebf", "SIP-110": "#8fb8d9", "SIP-120": "#bcd6ea",
            "EKF": "#777777", "SIP-L": "#3b8ea5",
            "SIP-KF": "#a05a2c"}  # fmt: skip
_KEYS = (("orientation", "orientation error [deg]"), ("position", "position error [cm]"))
# Kalman filters go astray: bars end here, and the number stands beside them.
_TALLEST = {"orientation": 60.0, "position": 25.0}


def draw_bars(cells: list[tuple[Cell, dict]], file: Path) -> Path:
    """Mean errors by clip (figures 9 and 10)."""
    usable = [(c, s) for c, s in cells if "orientation" in s]
    clips = list(dict.fromkeys(c.label for c, _ in usable))
    rows = [r for r in _COLOURS if any(c.row == r for c, _ in usable)]
    figure, axes = plt.subplots(2, 1, figsize=(9, 6), sharex=True, layout="constrained")
    width = 0.8 / max(len(rows), 1)
    for ax, (key, label) in zip(axes, _KEYS, strict=True):
        for k, row in enumerate(rows):
            for i, clip in enumerate(clips):
                own = [s for c, s in usable if (c.label, c.row) == (clip, row)]
                if not own:
                    continue
                value, x = pooled(own, key)[0], i + (k - (len(rows) - 1) / 2) * width
                ax.bar(x, min(value, _TALLEST[key]), width, color=_COLOURS[row],
                       label=row if i == 0 else None)  # fmt: skip
                if value > _TALLEST[key]:
                    ax.text(x, _TALLEST[key], f"{value:.0f}", ha="center", va="bottom", fontsize=7)
        ax.set_ylabel(label)
        ax.grid(axis="y", alpha=0.3)
    axes[0].legend(ncols=len(rows), fontsize=8, frameon=False)
    axes[1].set_xticks(range(len(clips)), [c.removesuffix("_60Hz") for c in clips], fontsize=8)
    axes[0].set_title("Six boards, field profile: thighs and upper arms held out; 13 joints")
    figure.savefig(file, dpi=110)
    plt.close(figure)
    return file


def draw_curve(cells: list[tuple[Cell, dict]], clip: str, file: Path) -> Path | None:
    """Errors over time of one clip (figure 8: jumping jacks); None where there is nothing."""
    own = [(c, s) for c, s in cells if c.label == clip and c.seed == 0 and "curve" in s]
    own = [(c, s) for c, s in own if c.row in ("SOP", "SIP-M", "SIP")]
    if not own:
        return None
    figure, axes = plt.subplots(2, 1, figsize=(9, 5), sharex=True, layout="constrained")
    for cell, scores in own:
        curve = scores["curve"]
        for ax, (key, _) in zip(axes, _KEYS, strict=True):
            ax.plot(np.array(curve["time"]), curve[key], color=_COLOURS[cell.row], label=cell.row)
    for ax, (_, label) in zip(axes, _KEYS, strict=True):
        ax.set_ylabel(label)
        ax.set_ylim(0)
        ax.grid(alpha=0.3)
    axes[0].legend(ncols=3, fontsize=8, frameon=False)
    axes[0].set_title(f"{clip}: mean error over time")
    axes[1].set_xlabel("time [s]")
    figure.savefig(file, dpi=110)
    plt.close(figure)
    return file
