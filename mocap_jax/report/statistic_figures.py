"""Residual statistics of sensors, and the history of the cost."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mocap_jax.report.statistic_streams import KINDS, sensors_of
from mocap_jax.report.style import INK, MUTED, RC, plain_name, quiet_grid
from mocap_jax.solution import Solution


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
            panel.set_yticks(np.arange(len(names)), [plain_name(n) for n in names])
            panel.invert_yaxis()
            panel.set_title(kind)
            panel.set_xlabel("whitened RMS [1]")
            panel.grid(axis="y", visible=False)
            panel.set_axisbelow(True)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return figure


def _names(solutions: dict[str, Solution], kind: str) -> list[str]:
    """Sensors that have statistics, in the order of the set-up where it names them."""
    measured = dict.fromkeys(n for s in solutions.values() for n in sensors_of(s, kind))
    worn = [s.name for s in next(iter(solutions.values())).setup.sensors]
    return sorted(measured, key=lambda n: worn.index(n) if n in worn else len(worn))


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
        panel.set_xlabel("accepted iteration, over all rounds")
        panel.set_ylabel("cost [1]")
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.legend(loc="upper right")
        quiet_grid(panel)
    return figure
