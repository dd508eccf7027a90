"""Positions of hands and feet relative to the pelvis over time, with their stated uncertainty."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mocap_jax.recording import Recording
from mocap_jax.report.angle_figures import Curves, finish, shared_segments, thinned, truths_of
from mocap_jax.report.style import INK, MUTED, RC, plain_name
from mocap_jax.report.uncertainty import root_relative_position_std
from mocap_jax.solution import Solution
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import root_segment, segment_poses

_ENDS = ("RightHand", "LeftHand", "RightFoot", "LeftFoot")
_AXES = ("forward", "up", "to the right")


def position_figure(
    solutions: dict[str, Solution], colours: dict[str, str], recording: Recording | None
) -> Figure | None:
    """Where hands and feet are in the root segment's anatomical frame.

    None where the body has none of them.
    """
    shared = shared_segments(solutions, recording)
    shown = [n for n in _ENDS if n in shared]
    if not shown:
        return None
    curves = {name: thinned(s) for name, s in solutions.items()}
    truth = next(iter(truths_of(recording, curves).values()), None)
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 5.6), layout="constrained")
        panels = figure.subplots(3, len(shown), sharex=True, squeeze=False)
        if truth is not None:
            for column, places in zip(panels.T, _places(truth, shown), strict=True):
                for panel, values in zip(column, places.T, strict=True):
                    panel.plot(truth.time, 100 * values, color=INK, lw=2.2, alpha=0.28,
                               label="truth")  # fmt: skip
        for name, curve in curves.items():
            std = root_relative_position_std(solutions[name], shown, curve.rows)
            for i, (column, places) in enumerate(zip(panels.T, _places(curve, shown), strict=True)):
                for axis, panel in enumerate(column):
                    deviation = None if std is None else std[:, i, axis]
                    _curve(panel, curve.time, places[:, axis], deviation, colours[name], name)
        _label(panels, shown)
        finish(figure, panels, solutions, recording)
    return figure


def _curve(
    panel: Axes, time: np.ndarray, place: np.ndarray, std: np.ndarray | None, colour: str, name: str
) -> None:
    """One coordinate with two standard deviations to either side; the scale is the curve's."""
    if std is not None:
        low, high = 100 * (place - 2 * std), 100 * (place + 2 * std)
        band = panel.fill_between(time, low, high, color=colour, alpha=0.15, lw=0)
        band.remove()
        panel.add_collection(band, autolim=False)
    panel.plot(time, 100 * place, color=colour, lw=1.0, label=name)


def _label(panels: np.ndarray, shown: list[str]) -> None:
    for segment, column in zip(shown, panels.T, strict=True):
        for axis, panel in zip(_AXES, column, strict=True):
            panel.set_title(f"{axis} [cm]", fontweight="normal", color=MUTED)
        column[0].set_title(f"{plain_name(segment)}: {_AXES[0]} [cm]", color=INK)
        column[-1].set_xlabel("time [s]")


def _places(curve: Curves, segments: list[str]) -> list[Float[np.ndarray, "t 3"]]:
    """Positions [m] of segments in the root segment's anatomical frame."""
    topology = curve.body.topology
    root = root_segment(topology)
    R, p = segment_poses(curve.body, curve.q)
    R_world_anatomical = R[:, root] @ anatomical_frames(curve.body)[root]
    return [
        np.einsum("tij,ti->tj", R_world_anatomical, p[:, topology.body_index(n)] - p[:, root])
        for n in segments
    ]
