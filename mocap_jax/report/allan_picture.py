"""Allan deviation of still sensors, with the noise processes read off it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mocap_jax.calibration import AllanCurve, AllanFit, NoiseCalibration, SensorNoise
from mocap_jax.calibration.allan import fit_processes
from mocap_jax.io.atomic import atomic_file
from mocap_jax.report.style import ESTIMATE, INK, METHOD_COLOURS, MUTED, RC, plain_name

_UNITS = {
    "accelerometer": ("m/s$^2$", "m/s$^{1.5}$", "m/s$^{2.5}$"),
    "gyroscope": ("rad/s", "rad/s$^{0.5}$", "rad/s$^{1.5}$"),
}


def allan_figure(found: NoiseCalibration) -> Figure:
    """One panel for each kind of sensor: all axes, their mean with its band, and the processes."""
    kinds = [kind for kind, sensors in found.sensors.items() if sensors]
    with rc_context(RC):
        figure = Figure(figsize=(5.6 * len(kinds), 4.6), layout="constrained")
        panels = figure.subplots(1, len(kinds), squeeze=False)[0]
        for panel, kind in zip(panels, kinds, strict=True):
            _panel(panel, kind, found.sensors[kind])
        figure.suptitle(
            "How much the mean over a time differs from the next mean. "
            "Falling: noise averages out. Rising: the zero wanders.",
            fontsize=9, color=MUTED,
        )  # fmt: skip
    return figure


def write_allan_picture(path: str | os.PathLike[str], found: NoiseCalibration) -> None:
    """Draw the figure to a file (.png, .svg, .pdf), whole or not at all."""
    with rc_context(RC), atomic_file(path) as stream:
        allan_figure(found).savefig(stream, format=Path(path).suffix[1:].lower(), dpi=130)


def _panel(panel: Axes, kind: str, sensors: dict[str, SensorNoise]) -> None:
    unit = _UNITS[kind][0]
    for colour, axis in zip(METHOD_COLOURS[1:], range(3), strict=False):
        for i, noise in enumerate(sensors.values()):
            panel.loglog(
                noise.curve.tau, noise.curve.deviation[:, axis], color=colour, lw=0.8, alpha=0.6,
                label="xyz"[axis] + " axes" * (len(sensors) > 1) if i == 0 else None,
            )  # fmt: skip
    curve = _mean(sensors)
    deviation, sigma = curve.deviation[:, 0], curve.relative_sigma
    panel.loglog(curve.tau, deviation, color=INK, lw=1.8, label="mean of all axes (RMS)")
    panel.fill_between(
        curve.tau, deviation / (1 + sigma), deviation * (1 + sigma), color=INK, alpha=0.12, lw=0,
        label="its standard deviation",
    )  # fmt: skip
    panel.set_ylim(0.5 * _lowest(curve, sensors), 3.0 * _highest(sensors))
    _processes(panel, kind, curve)
    name = plain_name(next(iter(sensors))) if len(sensors) == 1 else f"{len(sensors)} boards"
    panel.set_title(f"{kind}, {name}")
    panel.set_xlabel("averaging time [s]")
    panel.set_ylabel(f"Allan deviation [{unit}]")
    panel.grid(which="minor", visible=False)
    panel.legend(fontsize=7.5, loc="best")


def _mean(sensors: dict[str, SensorNoise]) -> AllanCurve:
    """RMS over all boards and axes, at the averaging times of the shortest recording."""
    curves = [noise.curve for noise in sensors.values()]
    shortest = min(curves, key=lambda c: c.tau[-1])
    columns = [
        np.exp(np.interp(np.log(shortest.tau), np.log(c.tau), np.log(column)))
        for c in curves
        for column in c.deviation.T
    ]
    rms = np.sqrt(np.mean(np.square(columns), axis=0))
    return AllanCurve(shortest.tau, rms[:, None], shortest.freedom * len(columns))


def _processes(panel: Axes, kind: str, curve: AllanCurve) -> None:
    """The fitted processes as straight lines, each named where it lies."""
    octaves = np.unique(
        [np.abs(np.log(curve.tau / t)).argmin() for t in _doublings(curve.tau[0], curve.tau[-1])]
    )
    fit = fit_processes(
        AllanCurve(curve.tau[octaves], curve.deviation[octaves], curve.freedom[octaves])
    )
    t = np.geomspace(curve.tau[0], curve.tau[-1], 60)
    panel.loglog(
        t,
        fit.deviation(t)[:, 0],
        color=ESTIMATE,
        lw=1.2,
        zorder=3,
        ls="-",
        label="fit to it, the sum of:",
    )
    for text, style, line in _lines(kind, fit, t):
        panel.loglog(t, line, color=MUTED, lw=1.0, ls=style, label=text)


def _doublings(first: float, last: float) -> np.ndarray:
    return first * 2.0 ** np.arange(int(np.log2(last / first)) + 1)


def _lines(kind: str, fit: AllanFit, t: np.ndarray) -> list[tuple[str, Any, np.ndarray]]:
    """Text, style and line of each process that was seen."""
    unit, white, walk = _UNITS[kind]
    parts = (fit.white, fit.instability, fit.random_walk, fit.quantisation)
    n, b, k, q = (float(x[0]) for x in parts)
    floor = np.sqrt(2.0 * np.log(2.0) / np.pi)
    lines: list[tuple[str, Any, np.ndarray]] = [
        (f"white noise {n:.2g} {white} (slope -1/2, at 1 s)", ":", n / np.sqrt(t))
    ]
    if b:
        flat = np.full_like(t, floor * b)
        lines.append((f"bias instability {b:.2g} {unit} (flat at 0.664 of it)", "-.", flat))
    if k:
        rising = k * np.sqrt(t / 3.0)
        lines.append((f"random walk {k:.2g} {walk} (slope +1/2, at 3 s)", "--", rising))
    if q:
        lines.append((f"round-off {q:.2g} (slope -1)", (0, (1, 3)), np.sqrt(3.0) * q / t))
    return lines


def _lowest(curve: AllanCurve, sensors: dict[str, SensorNoise]) -> float:
    lowest = min(float(noise.curve.deviation.min()) for noise in sensors.values())
    return min(lowest, float(curve.deviation.min()))


def _highest(sensors: dict[str, SensorNoise]) -> float:
    return max(float(noise.curve.deviation.max()) for noise in sensors.values())
