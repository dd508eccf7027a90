"""Figure 4: where a wrist's board is, by double integration of its accelerations and by SIP."""

from __future__ import annotations

from pathlib import Path

import jax
import matplotlib
import numpy as np
from jaxtyping import Float
from scipy.integrate import cumulative_trapezoid

import mocap_jax as mj
from mocap_jax import so3
from mocap_jax.body import site_frames
from mocap_jax.metrics.align import align
from mocap_jax.solution.poses import map_frames, segment_poses

matplotlib.use("Agg")
from matplotlib import pyplot as plt

BOARD = "left_forearm"
_COLOURS = {"SOP": "#e0a800", "SIP": "#1f6fb4", "double integration": "#c0392b"}


def integrated(recording: mj.Recording, board: str) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and path [m] of a board from its accelerations and measured orientations alone.

    It starts at rest in the origin. What it reads in the rest hold is taken for gravity, so that
    the error of tilt and the bias there do no harm at first.
    """
    stream = recording.inertial[board]
    time, f = np.asarray(stream.time), np.asarray(stream.accelerometer)
    R = np.asarray(so3.quat_to_matrix(np.asarray(stream.orientation)))
    a = np.einsum("tij,tj->ti", R, f)
    for column in a.T:  # readings that were lost
        known = np.isfinite(column)
        column[:] = np.interp(time, time[known], column[known])
    rest = recording.setup.rest
    assert rest is not None
    still = (time >= rest.start) & (time <= rest.end)
    a = a - a[still].mean(axis=0)
    begin = int(np.flatnonzero(still)[-1])
    a, time = a[begin:], time[begin:]
    v = cumulative_trapezoid(a, time, axis=0, initial=0)
    return time, cumulative_trapezoid(v, time, axis=0, initial=0)


def board_paths(
    solutions: dict[str, mj.Solution], recording: mj.Recording, board: str = BOARD
) -> tuple[np.ndarray, dict[str, Float[np.ndarray, "t 3"]]]:
    """Times and paths of a board [m]: the truth's and the estimates', each on the true root.

    The first moment is the origin.
    """
    paths = {}
    for row, solution in solutions.items():
        pair = align(solution, recording, from_time=_after_rest(recording))
        true_root = segment_poses(pair.reference_body, pair.reference_q)[1][:, 1]
        root = segment_poses(pair.body, pair.q)[1][:, 1]
        paths["truth"] = _site(pair.reference_body, pair.reference_q, board)
        paths[row] = _site(pair.body, pair.q, board) - root + true_root
    time, found = integrated(recording, board)
    moment = [np.interp(pair.time, time, column) for column in found.T]
    paths["double integration"] = np.stack(moment, axis=1)
    return pair.time, {row: path - path[0] for row, path in paths.items()}


def _after_rest(recording: mj.Recording) -> float:
    rest = recording.setup.rest
    return 0.0 if rest is None else rest.end


@jax.jit
def _positions(body: mj.Body, q: jax.Array) -> jax.Array:
    return jax.vmap(lambda one: site_frames(body, one).position)(q)


def _site(body: mj.Body, q: np.ndarray, name: str) -> Float[np.ndarray, "t 3"]:
    return map_frames(_positions, (body,), q)[:, body.site_index(name)]


def draw_paths(time: np.ndarray, paths: dict[str, np.ndarray], title: str, file: Path) -> Path:
    """Sideways and upward coordinates over time."""
    figure, axes = plt.subplots(2, 1, figsize=(9, 5), sharex=True, layout="constrained")
    for ax, axis, label in zip(axes, (1, 2), ("y (sideways) [m]", "z (up) [m]"), strict=True):
        ax.plot(time, paths["truth"][:, axis], color="0.7", lw=4, label="truth")
        for row, colour in _COLOURS.items():
            if row in paths:
                ax.plot(time, paths[row][:, axis], color=colour, lw=1.3, label=row)
        low, high = np.ptp(paths["truth"][:, axis]) * np.array([-0.6, 0.6])
        middle = 0.5 * (paths["truth"][:, axis].min() + paths["truth"][:, axis].max())
        # What is integrated twice leaves the picture, whatever its scale.
        ax.set_ylim(middle + 1.6 * low, middle + 1.6 * high)
        ax.set_ylabel(label)
        ax.grid(alpha=0.3)
    axes[0].set_title(title)
    axes[0].legend(ncols=4, fontsize=8, frameon=False)
    axes[1].set_xlabel("time [s]")
    figure.savefig(file, dpi=110)
    plt.close(figure)
    return file


def path_errors(time: np.ndarray, paths: dict[str, np.ndarray]) -> str:
    """RMS error of each path [cm], and where double integration ends."""
    true = paths["truth"]
    lines = [
        f"{row:<20} {100 * np.sqrt(((path - true) ** 2).sum(axis=1).mean()):8.1f}   "
        f"{100 * np.linalg.norm(path[-1] - true[-1]):8.1f}"
        for row, path in paths.items()
        if row != "truth"
    ]
    head = f"Path of {BOARD} over {time[-1] - time[0]:.1f} s [cm]:  RMS   at the end"
    return "\n".join([head, *lines])
