"""Residual statistics, ranges between sources and receivers, and the history of the cost."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mocap_jax.report.style import INK, MUTED, RC, quiet_grid
from mocap_jax.solution import Solution

KINDS = ("accelerometer", "gyroscope", "orientation", "magnetometer")


def sensors_of(solution: Solution, kind: str) -> dict[str, dict[str, float]]:
    """Statistics of one kind of measurement by sensor."""
    prefix = f"{kind}/"
    return {
        key.removeprefix(prefix): value
        for key, value in solution.statistics.items()
        if key.startswith(prefix)
    }


def residual_figure(solutions: dict[str, Solution], colours: dict[str, str]) -> Figure | None:
    """Whitened RMS of every sensor, one panel for each kind of measurement."""
    kinds = [k for k in KINDS if any(sensors_of(s, k) for s in solutions.values())]
    if not kinds:
        return None
    with rc_context(RC):
        most = max(len(_names(solutions, k)) for k in kinds)
        figure = Figure(figsize=(10.5, 0.24 * most + 1.3), layout="constrained")
        panels = figure.subplots(1, len(kinds), squeeze=False)[0]
        for panel, kind in zip(panels, kinds, strict=True):
            names = _names(solutions, kind)
            height = 0.8 / len(solutions)
            for i, (method, solution) in enumerate(solutions.items()):
                found = sensors_of(solution, kind)
                values = [found.get(n, {}).get("rms", np.nan) for n in names]
                panel.barh(np.arange(len(names)) + (i - (len(solutions) - 1) / 2) * height, values,
                           height, color=colours[method], label=method)  # fmt: skip
            panel.axvline(1.0, color=INK, lw=0.9, ls=(0, (4, 3)))
            panel.set_yticks(np.arange(len(names)), [_plain(n) for n in names])
            panel.invert_yaxis()
            panel.set_title(kind)
            panel.set_xlabel("whitened RMS [1]")
            panel.grid(axis="y", visible=False)
            panel.set_axisbelow(True)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return figure


def _names(solutions: dict[str, Solution], kind: str) -> list[str]:
    return list(dict.fromkeys(n for s in solutions.values() for n in sensors_of(s, kind)))


def _plain(name: str) -> str:
    # A dollar sign would start a formula.
    return name.replace("_", " ").replace("$", r"\$")


def range_pairs(solution: Solution) -> dict[tuple[str, str], dict[str, float]]:
    """Statistics of ranges by (source, receiver)."""
    receivers = sorted((s.name for s in solution.setup.sensors), key=len, reverse=True)
    out = {}
    for key, value in sensors_of(solution, "range").items():
        known = next((r for r in receivers if key.endswith(f"-{r}")), None)
        receiver = known if known is not None else key.rpartition("-")[2]
        out[key[: len(key) - len(receiver) - 1], receiver] = value
    return out


def range_figure(solutions: dict[str, Solution]) -> Figure | None:
    """Whitened RMS of every source-receiver pair; empty where a pair was never heard."""
    chosen = {m: range_pairs(s) for m, s in solutions.items()}
    chosen = {m: pairs for m, pairs in chosen.items() if pairs}
    if not chosen:
        return None
    first = next(iter(chosen.values()))
    sources = list(dict.fromkeys(source for source, _ in first))
    receivers = list(dict.fromkeys(receiver for _, receiver in first))
    with rc_context(RC):
        size = (10.5, 0.25 * len(receivers) + 1.6)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(1, len(chosen), squeeze=False)[0]
        for panel, (method, pairs) in zip(panels, chosen.items(), strict=True):
            rms = np.full((len(receivers), len(sources)), np.nan)
            for (source, receiver), value in pairs.items():
                if source in sources and receiver in receivers and value.get("count", 1):
                    rms[receivers.index(receiver), sources.index(source)] = value["rms"]
            image = panel.imshow(rms, cmap="YlGnBu", norm=LogNorm(0.3, 30.0), aspect="auto")
            for row, column in zip(*np.nonzero(np.isfinite(rms)), strict=True):
                value = rms[row, column]
                panel.text(column, row, f"{value:.1f}", ha="center", va="center", size=7,
                           color="white" if value > 4.0 else INK)  # fmt: skip
            panel.set_xticks(range(len(sources)), [_plain(s) for s in sources], rotation=35,
                             ha="right")  # fmt: skip
            panel.set_yticks(range(len(receivers)), [_plain(r) for r in receivers])
            panel.set_title(method)
            panel.grid(visible=False)
            panel.tick_params(length=0)
            panel.spines[:].set_visible(False)
        figure.colorbar(image, ax=panels, label="whitened RMS [1]", shrink=0.8, pad=0.01)
    return figure


def cost_figure(solutions: dict[str, Solution], colours: dict[str, str]) -> Figure | None:
    """Cost after each iteration, of the methods that iterate."""
    chosen = {m: s for m, s in solutions.items() if len(s.cost) > 1}
    if not chosen:
        return None
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 2.8), layout="constrained")
        panel = figure.subplots()
        for method, solution in chosen.items():
            cost = np.asarray(solution.cost, float)
            panel.plot(np.arange(len(cost)), cost, color=colours[method], marker="o", ms=3.5,
                       lw=1.2, label=method)  # fmt: skip
            panel.annotate(f"{cost[-1]:.4g}", (len(cost) - 1, cost[-1]), xytext=(6, 4),
                           textcoords="offset points", color=MUTED)  # fmt: skip
        if all(min(s.cost) > 0 for s in chosen.values()):
            panel.set_yscale("log")
        panel.set_xlabel("iteration")
        panel.set_ylabel("cost [1]")
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.legend(loc="upper right")
        quiet_grid(panel)
    return figure
