"""Joint angles over time against the truth, with the orientation difference below them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mocap_jax.body import Body
from mocap_jax.metrics.align import interpolate, truth_of
from mocap_jax.metrics.rotation_angle import rotation_angle
from mocap_jax.recording import Recording
from mocap_jax.report.style import INK, MUTED, RC
from mocap_jax.report.uncertainty import angle_std, cardan_std, relative_rotation_std
from mocap_jax.solution import Solution
from mocap_jax.solution.anatomy import JointAngle, joint_angle_list
from mocap_jax.solution.angles import joint_angles, root_relative_angles
from mocap_jax.solution.cardan import locked
from mocap_jax.solution.poses import root_segment, segment_poses
from mocap_jax.trajectory import Trajectory

_TRUNK_JOINTS = {
    "Head": "Neck",
    "RightUpperArm": "Right shoulder",
    "LeftUpperArm": "Left shoulder",
    "RightUpperLeg": "Right hip",
    "LeftUpperLeg": "Left hip",
}
# Figure 6 of the paper shows these three.
_SHOWN = ("Head", "RightUpperArm", "LeftUpperLeg")
_HINGES = {
    "RightForeArm": "Right elbow",
    "LeftForeArm": "Left elbow",
    "RightLowerLeg": "Right knee",
    "LeftLowerLeg": "Left knee",
}
_MOST_POINTS = 700
_LOCK = np.deg2rad(5.0)


@dataclass(frozen=True)
class Curves:
    """One motion, thinned for drawing."""

    time: Float[np.ndarray, "t"]
    body: Body
    q: Float[np.ndarray, "t nq"]
    R_world: Float[np.ndarray, "t nbody 3 3"]
    rows: np.ndarray
    """Which frames of the solution these are."""


def thinned(solution: Solution) -> Curves:
    """At most `_MOST_POINTS` frames of a solution, evenly spaced."""
    time, q = np.asarray(solution.trajectory.time), np.asarray(solution.trajectory.q)
    rows = np.arange(0, len(time), max(1, -(-len(time) // _MOST_POINTS)))
    R_world, _ = segment_poses(solution.body, q[rows])
    return Curves(time[rows], solution.body, q[rows], R_world, rows)


def truth_at(recording: Recording, curves: Curves) -> Curves:
    """The truth at the same times."""
    body, trajectory = truth_of(recording)
    q = interpolate(body, trajectory, curves.time)
    return Curves(curves.time, body, q, segment_poses(body, q)[0], curves.rows)


def trunk_figure(
    solutions: dict[str, Solution], colours: dict[str, str], recording: Recording | None
) -> Figure | None:
    """Neck, right shoulder and left hip relative to the root: three angles and the difference.

    The layout of Vlasic 2007, figure 6. None where the body has none of these segments.
    """
    shared = shared_segments(solutions, recording)
    shown = [n for n in _SHOWN if n in shared]
    if not shown:
        return None
    curves = {name: thinned(s) for name, s in solutions.items()}
    truths = truths_of(recording, curves)
    rows = 4 if truths else 3
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 1.75 * rows + 0.5), layout="constrained")
        panels = figure.subplots(rows, len(shown), sharex=True, squeeze=False)
        for column, segment in enumerate(shown):
            _angle_panels(panels[:3, column], segment, solutions, curves, truths, colours)
            named = panels[0, column].get_title(loc="left")
            panels[0, column].set_title(f"{_TRUNK_JOINTS[segment]}: {named}", color=INK)
            if truths:
                _difference_panel(panels[3, column], segment, solutions, curves, truths, colours)
            panels[-1, column].set_xlabel("time [s]")
        finish(figure, panels, solutions, recording)
    return figure


def truths_of(recording: Recording | None, curves: dict[str, Curves]) -> dict[str, Curves]:
    """The truth at the times of every method; empty without truth."""
    if recording is None or recording.truth is None:
        return {}
    return {name: truth_at(recording, curve) for name, curve in curves.items()}


def _has(recording: Recording | None) -> bool:
    return recording is not None and recording.truth is not None


def shared_segments(solutions: dict[str, Solution], recording: Recording | None) -> set[str]:
    """Segments that all bodies have."""
    sets = [set(s.body.topology.body_names) for s in solutions.values()]
    if recording is not None and recording.truth is not None:
        sets.append(set(truth_of(recording)[0].topology.body_names))
    return set.intersection(*sets)


def _angle_panels(
    panels: np.ndarray,
    segment: str,
    solutions: dict[str, Solution],
    curves: dict[str, Curves],
    truths: dict[str, Curves],
    colours: dict[str, str],
) -> None:
    for name, curve in curves.items():
        near = None
        if name in truths:
            true = truths[name]
            _, near = root_relative_angles(true.body, true.R_world, segment)
        labels, angles = root_relative_angles(curve.body, curve.R_world, segment, near)
        root = curve.body.topology.body_names[root_segment(curve.body.topology)]
        std = cardan_std(solutions[name], segment, root, curve.rows)
        for axis, panel in enumerate(panels):
            if std is not None:
                _band(panel, curve.time, _shown(angles)[:, axis], std[:, axis], colours[name])
            if near is not None and not panel.get_lines():
                panel.plot(curve.time, _shown(near)[:, axis], color=INK, lw=2.2, alpha=0.28,
                           label="truth")  # fmt: skip
            panel.plot(curve.time, _shown(angles)[:, axis], color=colours[name], lw=1.0, label=name)
            panel.set_title(
                labels[axis].replace("_", " ") + " [deg]", fontweight="normal", color=MUTED
            )


def _band(panel: Axes, time: np.ndarray, degrees: np.ndarray, std: np.ndarray, colour: str) -> None:
    """Two standard deviations to either side; the scale stays that of the curves."""
    wide = np.minimum(np.rad2deg(2 * std), 180.0)
    band = panel.fill_between(time, degrees - wide, degrees + wide, color=colour, alpha=0.15, lw=0)
    band.remove()
    panel.add_collection(band, autolim=False)


def _shown(angles: np.ndarray) -> np.ndarray:
    """Angles in degrees; the outer two are left out near gimbal lock, where they mean nothing."""
    out = np.rad2deg(angles)
    out[locked(angles, _LOCK), ::2] = np.nan
    return out


def _turns(angles: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Whole turns [deg] between two curves, one figure per column (lengths may differ)."""
    middle = np.median(angles, axis=0) - np.median(reference, axis=0)
    return 360.0 * np.round(middle / 360.0)


def _difference_panel(
    panel: Axes,
    segment: str,
    solutions: dict[str, Solution],
    curves: dict[str, Curves],
    truths: dict[str, Curves],
    colours: dict[str, str],
) -> None:
    for name, curve in curves.items():
        truth = truths[name]
        root = curve.body.topology.body_names[root_segment(curve.body.topology)]
        error = rotation_angle(_relative(curve, segment), _relative(truth, segment))
        std = relative_rotation_std(solutions[name], [(segment, root)])
        if std is not None:
            panel.fill_between(curve.time, 0.0, np.rad2deg(2 * std[curve.rows, 0]),
                               color=colours[name], alpha=0.13, lw=0)  # fmt: skip
        panel.plot(curve.time, np.rad2deg(error), color=colours[name], lw=1.0)
    panel.set_title("orientation difference [deg]", fontweight="normal", color=MUTED)
    worst = max(float(np.nanmax(line.get_ydata(), initial=0.0)) for line in panel.get_lines())
    panel.set_ylim(0.0, 1.3 * worst if np.isfinite(worst) and worst > 0 else 1.0)


def _relative(curves: Curves, segment: str) -> np.ndarray:
    topology = curves.body.topology
    root, b = root_segment(topology), topology.body_index(segment)
    return np.swapaxes(curves.R_world[:, root], -1, -2) @ curves.R_world[:, b]


def hinge_figure(
    solutions: dict[str, Solution], colours: dict[str, str], recording: Recording | None
) -> Figure | None:
    """Elbow and knee angles over time, with two stated standard deviations around them.

    Bodies without these segments show their first four joint angles instead.
    """
    shared = shared_segments(solutions, recording)
    first = next(iter(solutions.values()))
    chosen = _chosen_angles(first.body, shared)
    if not chosen:
        return None
    with rc_context(RC):
        across = min(2, len(chosen))
        down = -(-len(chosen) // across)
        figure = Figure(figsize=(10.5, 2.0 * down + 0.5), layout="constrained")
        panels = figure.subplots(down, across, sharex=True, squeeze=False)
        drawn = {name: thinned(s) for name, s in solutions.items()}
        true = next(iter(truths_of(recording, drawn).values()), None)
        angles = {name: _named_angles(curve) for name, curve in drawn.items()}
        deviations = {name: angle_std(solutions[name], c.rows) for name, c in drawn.items()}
        true_angles = _named_angles(true) if true is not None else {}
        for panel, (angle, title) in zip(panels.flat, chosen, strict=False):
            if true is not None and angle.name in true_angles:
                panel.plot(true.time, true_angles[angle.name], color=INK, lw=2.2, alpha=0.28,
                           label="truth")  # fmt: skip
            for name, curve in drawn.items():
                values = angles[name].get(angle.name)
                if values is not None:
                    near = true_angles.get(angle.name)
                    std = deviations[name].get(angle.name)
                    _hinge_curve(panel, curve, values, near, std, colours[name])
                    panel.get_lines()[-1].set_label(name)
            panel.set_title(f"{title} [deg]")
        for panel in panels[-1]:
            panel.set_xlabel("time [s]")
        finish(figure, panels, solutions, recording)
    return figure


def _chosen_angles(body: Body, shared: set[str]) -> list[tuple[JointAngle, str]]:
    listed = [a for a in joint_angle_list(body) if a.name.split("/")[0] in shared]
    chosen = []
    for segment, title in _HINGES.items():
        found = [a for a in listed if a.name.split("/") == [segment, "flexion"]]
        chosen += [(a, f"{title}, flexion") for a in found]
    generic = [(a, a.name.replace("/", ", ").replace("_", " ")) for a in listed[:4]]
    return chosen or generic


def _hinge_curve(
    panel: Axes,
    curve: Curves,
    values: np.ndarray,
    near: np.ndarray | None,
    std: np.ndarray | None,
    colour: str,
) -> None:
    """One method's angle with its band, turned to be near another curve."""
    if near is not None:
        values = values - _turns(values[:, None], near[:, None])[0]
    if std is not None:
        _band(panel, curve.time, values, std, colour)
    panel.plot(curve.time, values, color=colour, lw=1.0)


def _named_angles(curves: Curves) -> dict[str, np.ndarray]:
    """All joint angles [deg] by name."""
    names, angles = joint_angles(curves.body, Trajectory(curves.time, curves.q))
    return dict(zip(names, np.rad2deg(angles).T, strict=True))


def finish(
    figure: Figure,
    panels: np.ndarray,
    solutions: dict[str, Solution],
    recording: Recording | None,
) -> None:
    """Legend, and a pale stretch for what is not scored."""
    handles, labels = panels.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    start = max(s.setup.score_from for s in solutions.values())
    for panel in panels.flat:
        panel.margins(x=0.01)
        if start > 0 and _has(recording):
            low, high = panel.get_xlim()
            if low < start < high:
                panel.axvspan(low, start, color="#f3f5f7", zorder=0, lw=0)
                panel.set_xlim(low, high)
