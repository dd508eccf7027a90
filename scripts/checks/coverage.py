"""Real motion: how often the truth lies inside the intervals that each method states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from clips import load_clip

import mocap_jax as mj
from mocap_jax.metrics import JointConsistency, joint_consistency, nees


@dataclass(frozen=True)
class Row:
    """One estimate of one clip."""

    clip: str
    method: str
    frames: int
    joints: JointConsistency
    nees: float
    """Of whole poses, unobserved joints included, per degree of freedom."""


def rows_of(
    clip: str, profile: str, seed: int, seconds: float | None, orientations: float | None = None
) -> Iterator[Row]:
    """Simulate a clip and estimate it with the filter, the smoother and the optimiser.

    Args:
        clip: its name or file.
        profile: of the simulation.
        seed: of it.
        seconds: length of the clip; None for all of it.
        orientations: model error of measured orientations [rad]; None where boards report none.
    """
    recording = mj.simulate(
        load_clip(clip, seconds), profile=profile, seed=seed,
        options=mj.SimulationOptions(orientations=orientations is not None),
    )  # fmt: skip
    filtered = mj.ekf(recording)
    yield _row(clip, filtered, recording)
    smoothed = mj.ekf(recording, options=mj.EkfOptions(smooth=True))
    yield _row(clip, smoothed, recording)
    noise = mj.NoiseOptions() if orientations is None else mj.NoiseOptions(
        orientation_model=orientations
    )  # fmt: skip
    options = mj.OptimiseOptions(noise=noise)
    yield _row(clip, mj.optimise(recording, initial=smoothed, options=options), recording)


def _row(clip: str, solution: mj.Solution, recording: mj.Recording) -> Row:
    squared = nees(solution, recording)
    return Row(
        Path(clip).name, solution.method, len(squared), joint_consistency(solution, recording),
        float(np.nanmean(squared)),
    )  # fmt: skip
