"""Pictures of one clip: poses of SOP and SIP beside the truth, iterations, double integration."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from clips import subject_of

import mocap_jax as mj
from mocap_jax.initialise import declared_pose
from mocap_jax.simulation import SUITS
from sip2017.bodies import subject_body, worn
from sip2017.cells import Cell
from sip2017.compute import prior_without, record
from sip2017.integration import board_paths, draw_paths, path_errors
from sip2017.pose_grid import draw_grid

_SOP, _SIP, _BETWEEN = "#c0392b", "#1f6fb4", "#8fb8d9"
_POSES = 6
SNAPSHOTS = (1, 2, 4)
"""After which iterations poses are drawn, besides the start and the end."""


def reproduce_pictures(cell: Cell, folder: Path, *, iterations: bool = True) -> str:
    """Estimate a clip, draw `<clip>_poses.png`, `<clip>_iterations.png`, `<clip>_integrated.png`.

    Args:
        cell: clip, seed, suit, profile and length; its row does not count.
        folder: for the pictures.
        iterations: whether to draw iterations too, which takes a solve for each.
    """
    recording = record(cell)
    found = estimates(recording, cell, SNAPSHOTS if iterations else ())
    sop, sip = found[0], found[-1]
    times = np.linspace(recording.setup.score_from, recording.interval[1] - 0.1, _POSES + 2)[1:-1]
    name = cell.label
    files = [
        draw_grid(
            {"SIP": (sip, _SIP), "SOP": (sop, _SOP)}, recording, times, folder / f"{name}_poses.png"
        )
    ]
    if iterations:
        rows = {"start (SOP)": (sop, _SOP)}
        rows |= {f"iteration {k}": (found[k], _BETWEEN) for k in SNAPSHOTS if k in found}
        rows[f"SIP ({sip.iterations})"] = (sip, _SIP)
        files.append(
            draw_grid(rows, recording, times, folder / f"{name}_iterations.png", truth=False)
        )
    time, paths = board_paths({"SOP": sop, "SIP": sip}, recording)
    files.append(
        draw_paths(time, paths, f"{name}: left forearm's board", folder / f"{name}_integrated.png")
    )
    lines = [f"{name}: {_POSES} moments", _errors(found, recording), path_errors(time, paths)]
    return "\n".join([*lines, *(f"wrote {file}" for file in files)])


def estimates(
    recording: mj.Recording, cell: Cell, after: tuple[int, ...]
) -> dict[int, mj.Solution]:
    """SOP (0), the whole-sequence solve after some iterations, and its end (-1).

    The solve does the same each time, so that one that is cut short ends in what a longer one
    passes through.
    """
    recording = dataclasses.replace(recording, root=None)
    prior = prior_without(subject_of(cell.clip))
    on, body = worn(recording, subject_body(recording), SUITS[cell.sensors])
    start = mj.orientation_pass(
        on, body, start=declared_pose(on.setup.rest, body),
        options=mj.OrientationPassOptions(pose_prior=prior, warm_start=True), throw=True,
    )  # fmt: skip
    options = dataclasses.replace(mj.sparse_options(prior), root="free", covariance=False)
    found = {0: start}
    last = mj.optimise(on, body, initial=start, options=options, throw=True)
    for k in after:
        if k < last.iterations:
            solver = dataclasses.replace(options.solver, max_iterations=k)
            short = dataclasses.replace(options, solver=solver)
            found[k] = mj.optimise(on, body, initial=start, options=short)
    return found | {-1: last}


def _errors(found: dict[int, mj.Solution], recording: mj.Recording) -> str:
    """Orientation [deg] and position [cm] errors of every estimate."""
    lines = ["after iteration    orientation [deg]   position [cm]"]
    for k, solution in found.items():
        errors = mj.evaluate(solution, recording).errors
        turn = errors["validation_orientation_error_mean_deg"]["mean"]
        place = errors["marker_position_error_mean_cm"]["mean"]
        label = {0: "0 (SOP)", -1: f"{solution.iterations} (end)"}.get(k, str(k))
        lines.append(f"{label:<16} {turn:19.1f} {place:15.1f}")
    return "\n".join(lines)
