"""Compute cells: one recording at a time, with a pose prior that never saw its subject."""

from __future__ import annotations

import dataclasses
import traceback
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from clips import all_clips, load_clip, subject_of
from estimate_store import Store

import mocap_jax as mj
from mocap_jax.metrics import sparse_poser_series
from mocap_jax.simulation import SUITS, named_suit
from mocap_jax.simulation.mounting import with_shapes
from mocap_jax.simulation.suit import Suit
from sip2017.cells import Cell
from sip2017.rows import estimate

Report = Callable[[Cell, str], None]
"""Called after each cell with what went wrong (empty if nothing did)."""
# Seconds between the points of curves over time.
_CURVE_STEP = 0.1


def run_all(cells: list[Cell], store: Store, report: Report) -> None:
    """Compute all cells that the store lacks."""
    recordings: dict[tuple, Any] = {}
    for cell in cells:
        if store.has(cell):
            continue
        try:
            key = (cell.clip, cell.seed, cell.profile, cell.rate_hz, cell.cut)
            if key not in recordings:
                recordings = {key: record(cell)}
            prior = prior_without(subject_of(cell.clip))
            solution = estimate(cell.row, recordings[key], SUITS[cell.sensors], prior, cell.seed)
            store.write(cell, scores_of(cell, solution, recordings[key]))
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
        motion, profile=cell.profile, seed=cell.seed, suit=Suit(tuple(boards.values())),
        options=options,
    )  # fmt: skip


@cache
def prior_without(subject: str) -> mj.PosePrior:
    """Learned from the CMU clips of all other subjects."""
    clips = {Path(n).stem: n for n in all_clips() if subject_of(n) != subject}
    return mj.learn_pose_prior(
        {name: load_clip(n) for name, n in clips.items()}, name=f"CMU without subject {subject}"
    )


def scores_of(cell: Cell, solution: mj.Solution, recording: mj.Recording) -> dict:
    """All that tables and pictures need of one estimate, as plain numbers."""
    scores: dict = {
        "status": solution.status.name, "frames": len(solution.trajectory.time),
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
    return scores | curve(solution, recording)


def curve(solution: mj.Solution, recording: mj.Recording) -> dict[str, dict[str, list[float]]]:
    """Errors over time, thinned."""
    series = sparse_poser_series(solution, recording)
    step = float(np.median(np.diff(series.time)))
    every = max(1, round(_CURVE_STEP / step))
    return {"curve": {k: np.round(v[::every], 3).tolist() for k, v in series._asdict().items()}}


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
