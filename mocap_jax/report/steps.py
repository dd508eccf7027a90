"""What each step found: the pose at rest and the sensors' constants, beside the truth if known."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp
import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mocap_jax.body import Body, difference
from mocap_jax.errors import InputError
from mocap_jax.initialise import declared_pose
from mocap_jax.metrics.align import interpolate, truth_of
from mocap_jax.recording import Recording
from mocap_jax.report.constant_truth import constant_truth
from mocap_jax.report.style import INK, MUTED, RC, plain_name
from mocap_jax.solution import Solution
from mocap_jax.solution.methods import FILTERS

# Kind of constant: title, factor and unit for people.
CONSTANTS = {
    "mounting_rotation": ("Mounting rotation", 180 / np.pi, "deg"),
    "gyroscope_bias": ("Gyroscope offset", 180 / np.pi, "deg/s"),
    "accelerometer_bias": ("Accelerometer offset", 1.0, "m/s\u00b2"),
}
_DECLARED = "#ffffff"


@dataclass(frozen=True)
class Step:
    """Constants after one step of the estimation."""

    name: str
    colour: str
    values: dict[str, np.ndarray]
    deviations: dict[str, np.ndarray]
    truth: dict[str, np.ndarray] = field(default_factory=dict)


def steps_of(
    solutions: dict[str, Solution], colours: dict[str, str], recording: Recording | None = None
) -> list[Step]:
    """Steps that estimate constants: the rest hold (whose result filters use), and optimisers."""
    out: list[Step] = []
    for name, s in solutions.items():
        filtered = s.method in FILTERS
        if not s.calibration or (filtered and any(step.name == "Rest hold" for step in out)):
            continue
        step = Step("Rest hold" if filtered else name, colours[name], s.calibration,
                    s.calibration_std, constant_truth(s, recording))  # fmt: skip
        out.insert(0, step) if filtered else out.append(step)
    return out


def constants_figure(steps: list[Step]) -> Figure | None:
    """Per sensor and kind: how far from the truth each step ends (without truth: what it found)."""
    shown = {kind: _sensors(steps, kind) for kind in CONSTANTS}
    shown = {kind: sensors for kind, sensors in shown.items() if sensors}
    if not shown:
        return None
    most = max(len(s) for s in shown.values())
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 0.23 * most + 1.3), layout="constrained")
        panels = figure.subplots(1, len(shown), squeeze=False)[0]
        for panel, (kind, sensors) in zip(panels, shown.items(), strict=True):
            _constant_panel(panel, kind, sensors, steps)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return figure


def _sensors(steps: list[Step], kind: str) -> list[str]:
    keys = dict.fromkeys(k for step in steps for k in step.values if k.startswith(f"{kind}/"))
    return [k.removeprefix(f"{kind}/") for k in keys]


def _constant_panel(panel: Axes, kind: str, sensors: list[str], steps: list[Step]) -> None:
    title, factor, unit = CONSTANTS[kind]
    rows = np.arange(len(sensors))
    keys = [f"{kind}/{sensor}" for sensor in sensors]
    truth = steps[-1].truth
    known = all(key in step.truth for key in keys for step in steps)
    if known:
        panel.plot(np.array([factor * np.linalg.norm(truth[k]) for k in keys]), rows, "o", ms=5.5,
                   mfc=_DECLARED, mec=MUTED, label="declared (before any step)")  # fmt: skip
    for i, step in enumerate(steps):
        at = rows + 0.16 * (i - (len(steps) - 1) / 2)
        centre = [step.truth[k] if known else np.zeros(3) for k in keys]
        size = [factor * np.linalg.norm(step.values[k] - c) if k in step.values else np.nan
                for k, c in zip(keys, centre, strict=True)]  # fmt: skip
        stated = [factor * np.linalg.norm(step.deviations.get(k, np.nan)) for k in keys]
        panel.barh(at, stated, 0.13, color=step.colour, alpha=0.25, lw=0)
        panel.plot(np.array(size), at, "o", ms=4.5, color=step.colour, label=step.name)
    panel.set_yticks(rows, [plain_name(s) for s in sensors])
    panel.invert_yaxis()
    panel.set_xlim(left=0.0)
    panel.set_title(title)
    panel.set_xlabel(f"{'distance from the truth' if known else 'size'} [{unit}]")
    panel.grid(axis="y", visible=False)


def rest_figure(
    solutions: dict[str, Solution], colours: dict[str, str], recording: Recording | None
) -> Figure | None:
    """How far every joint is from the declared rest pose, by method, and the truth if known.

    Poses are those in the middle of the rest hold; None where no rest hold is declared or the
    solutions' bodies differ.
    """
    found = _rest_deviations(solutions, recording)
    if not found:
        return None
    joints = next(iter(found.values()))[0]
    rows = np.arange(len(joints))
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 0.19 * len(joints) + 1.2), layout="constrained")
        panel, right = figure.subplots(1, 2, sharey=True)
        true = found.pop("", None)
        for name, (_, turn) in found.items():
            size = np.rad2deg(np.linalg.norm(turn, axis=1))
            panel.plot(size, rows, "o", ms=4, color=colours[name], label=name)
            if true is not None:
                error = np.rad2deg(np.linalg.norm(turn - true[1], axis=1))
                right.plot(error, rows, "o", ms=4, color=colours[name])
        if true is not None:
            size = np.rad2deg(np.linalg.norm(true[1], axis=1))
            panel.plot(size, rows, "D", ms=5, mfc="none", mec=INK, label="truth")
            right.plot(size, rows, "o", ms=5, mfc=_DECLARED, mec=MUTED, zorder=1)
            right.set_title("Distance from the true rest pose [deg]")
        else:
            right.set_axis_off()
        panel.set_title("Distance from the declared rest pose [deg]")
        panel.set_yticks(rows, [plain_name(j) for j in joints], size=7.5)
        panel.invert_yaxis()
        for side in (panel, right):
            side.set_xlim(left=-0.3)
        handles, labels = panel.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return figure


def _rest_deviations(
    solutions: dict[str, Solution], recording: Recording | None
) -> dict[str, tuple[list[str], np.ndarray]]:
    """By method ("" for the truth): joints and their rotation from the declared pose (n, 3)."""
    out = {}
    first = next(iter(solutions.values()))
    rest = first.setup.rest
    if rest is None or not rest.pose:
        return {}
    middle = 0.5 * (rest.start + rest.end)
    for name, solution in solutions.items():
        if solution.body.topology != first.body.topology:
            return {}
        row = int(np.argmin(np.abs(np.asarray(solution.trajectory.time) - middle)))
        found = _deviation(solution.body, solution, np.asarray(solution.trajectory.q)[row])
        if found is None:
            return {}
        out[name] = found
    if recording is not None and recording.truth is not None:
        body, trajectory = truth_of(recording)
        if body.topology.joint_names == first.body.topology.joint_names:
            pose = interpolate(body, trajectory, np.array([middle]))[0]
            true = _deviation(first.body, first, pose)
            out |= {"": true} if true is not None else {}
    return out


def _deviation(
    body: Body, solution: Solution, q: np.ndarray
) -> tuple[list[str], np.ndarray] | None:
    try:
        declared = declared_pose(solution.setup.rest, body)
    except InputError:
        return None
    away = np.asarray(difference(body.topology, jnp.asarray(declared), jnp.asarray(q)))
    topology = body.topology
    names, turns = [], []
    for b in range(1, topology.nbody):
        turn = [
            away[topology.joint_dof[j] : topology.joint_dof[j] + width]
            for j in topology.joints_of_body(b)
            if (width := {"hinge": 1, "ball": 3}.get(topology.joint_types[j], 0))
        ]
        if turn:
            flat = np.concatenate(turn)[:3]
            names.append(topology.body_names[b])
            turns.append(np.pad(flat, (0, 3 - len(flat))))
    return (names, np.array(turns)) if names else None
