"""Compute cells: one recording at a time, with a pose prior that never saw its subject."""

from __future__ import annotations

import dataclasses
import traceback
from functools import cache
from pathlib import Path

import numpy as np
from clips import all_clips, load_clip, subject_of
from estimate_store import Store
from group_pool import Report, run_groups

import mocap_jax as mj
from mocap_jax.metrics import sparse_poser_series
from mocap_jax.metrics.sparse_poser import Series
from mocap_jax.simulation import SUITS, named_suit
from mocap_jax.simulation.mounting import with_shapes
from mocap_jax.simulation.suit import Suit
from sip2017.cells import Cell
from sip2017.rows import estimate

# Seconds between the points of curves over time.
_CURVE_STEP = 0.1


def run_all(cells: list[Cell], store: Store, workers: int, report: Report) -> None:
    """Compute all cells that the store lacks, in one or several processes."""
    groups: dict[tuple, list[Cell]] = {}
    for cell in cells:
        groups.setdefault((cell.clip, cell.seed), []).append(cell)
    run_groups(run_group, list(groups.values()), store, workers, report)


def run_group(group: list[Cell], store: Store, report: Report) -> None:
    """Compute the cells of one recording."""
    try:
        recording, prior = record(group[0]), prior_without(subject_of(group[0].clip))
    except mj.MocapError as error:
        for cell in group:
            report(cell, str(error))
        return
    for cell in group:
        try:
            sensors = SUITS[cell.sensors]
            limits = limits_without(subject_of(cell.clip)) if cell.row == "SIP-L" else None
            solution = estimate(cell.row, recording, sensors, prior, cell.draw, limits)
            store.write(cell, scores_of(cell, solution, recording))
            report(cell, "")
        except Exception as error:  # One estimate that fails must not cost the others.
            traceback.print_exc()
            report(cell, str(error) or type(error).__name__)


def record(cell: Cell) -> mj.Recording:
    """The recording of all boards of both layouts and of those that validate."""
    motion = load_clip(cell.clip, cell.cut)
    body = with_shapes(motion.body)
    boards = {b.name: b for name in SUITS for b in named_suit(name, body).boards}
    options = mj.SimulationOptions(inertial_rate_hz=cell.rate_hz, orientations=True)
    return mj.simulate(
        motion, profile=cell.profile, seed=cell.draw, suit=Suit(tuple(boards.values())),
        options=options,
    )  # fmt: skip


@cache
def prior_without(subject: str) -> mj.PosePrior:
    """Learned from the CMU clips of all other subjects."""
    clips = {Path(n).stem: n for n in all_clips() if subject_of(n) != subject}
    return mj.learn_pose_prior(
        {name: load_clip(n) for name, n in clips.items()}, name=f"CMU without subject {subject}"
    )


@cache
def limits_without(subject: str) -> mj.JointLimits:
    """Limits of joints from the same clips."""
    clips = {Path(n).stem: n for n in all_clips() if subject_of(n) != subject}
    motions = {name: load_clip(n) for name, n in clips.items()}
    return mj.learn_joint_limits(motions, prior_without(subject))


def scores_of(cell: Cell, solution: mj.Solution, recording: mj.Recording) -> dict:
    """All that tables and pictures need of one estimate, as plain numbers."""
    scores: dict = {
        "status": solution.status.name, "frames": 0,
        "iterations": solution.iterations, "seconds_solve": solution.seconds_solve,
    }  # fmt: skip
    if not solution.status.ok:
        return scores
    scores |= moments(solution, recording)
    if cell.row.startswith("SIP-1"):
        # Markers of a larger body differ even in the perfect pose: the rotations on the right one.
        own = mj.ball_jointed(mj.load_body(recording.body_xml))
        unscaled = dataclasses.replace(solution, body=own)
        scores["unscaled"] = moments(unscaled, recording)
    series = sparse_poser_series(solution, recording)
    return scores | {"frames": len(series.time), "curve": curve(series)}


def curve(series: Series) -> dict[str, list[float]]:
    """Errors over time, thinned."""
    step = float(np.median(np.diff(series.time)))
    every = max(1, round(_CURVE_STEP / step))
    return {k: np.round(v[::every], 3).tolist() for k, v in series._asdict().items()}


def moments(solution: mj.Solution, recording: mj.Recording) -> dict[str, list[float]]:
    """Mean and deviation over frames and sensors [deg], and frames and markers [cm]."""
    errors = mj.evaluate(solution, recording).errors
    return {
        name: [errors[f"{key}_{what}_{unit}"]["mean"] for what in ("mean", "std")]
        for name, key, unit in (
            ("orientation", "validation_orientation_error", "deg"),
            ("position", "marker_position_error", "cm"),
        )
    }
