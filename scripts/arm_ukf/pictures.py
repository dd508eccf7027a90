"""Pictures of `scripts/reproduce_arm_ukf`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from arm_ukf.trackers import JOINTS, OPTIMISER, PAPER
from mocap_jax.arm import ArmErrors, ArmTrack, reference_angles
from mocap_jax.arm.errors import ROWS, true_points
from mocap_jax.recording import Recording

_SHOWN = (PAPER, JOINTS, OPTIMISER)
_COLOURS = {PAPER: "#d95f02", JOINTS: "#7570b3", OPTIMISER: "#1b9e77"}
_SPAN = (10.0, 18.0)


def trial_figure(recording: Recording, tracks: dict[str, ArmTrack], file: Path) -> None:
    """Some seconds of a trial (compare the paper's figures 4 and 5): values, and their errors."""
    time, true = _truth(recording)
    labels = ("horizontal [cm]", "vertical [cm]", "shoulder [deg]", "elbow [deg]")
    figure = Figure(figsize=(11, 10), layout="constrained")
    axes = figure.subplots(4, 2, sharex=True)
    for i, label in enumerate(labels):
        values, errors = axes[i]
        values.plot(time, true[:, i], "k", lw=2.2, label="truth")
        for name in _SHOWN:
            found = tracks[name]
            here = _columns(found.wrist, found.angles)[:, i]
            values.plot(found.time, here, color=_COLOURS[name], lw=1, label=name)
            error = here - np.interp(found.time, time, true[:, i])
            errors.plot(found.time, error, color=_COLOURS[name], lw=1)
        values.set_ylabel(label)
        errors.set_ylabel(f"error, {label}")
        errors.axhline(0.0, color="k", lw=0.6)
        inside = (time >= _SPAN[0]) & (time <= _SPAN[1])
        low, high = true[inside, i].min(), true[inside, i].max()
        values.set_ylim(low - 0.15 * (high - low), high + 0.15 * (high - low))
    axes[0, 0].set_xlim(*_SPAN)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=4)
    figure.savefig(file, dpi=110)


def sweep_figure(columns: dict[str, dict[str, ArmErrors]], file: Path) -> None:
    """Standard deviations by anchor geometry."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    at = np.arange(len(columns))
    for i, (axis, row) in enumerate(zip(axes.flat, ROWS, strict=True)):
        for j, name in enumerate(_SHOWN):
            height = [each[name].std[i] for each in columns.values()]
            axis.bar(at + 0.27 * (j - 1), height, 0.25, color=_COLOURS[name], label=name)
        axis.set_title(f"standard deviation, {row}", size=10)
        axis.set_xticks(at, list(columns), rotation=35, ha="right", size=8)
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3)
    figure.savefig(file, dpi=110)


def _truth(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    points = true_points(recording)
    time = np.asarray(recording.truth.trajectory.time)  # type: ignore[union-attr]
    return time, _columns(points.wrist, reference_angles(points))


def _columns(wrist: np.ndarray, angles: np.ndarray) -> np.ndarray:
    return np.concatenate([100 * np.asarray(wrist)[:, [0, 2]], np.rad2deg(angles)], axis=1)
