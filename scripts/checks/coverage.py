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


def rows_of(clip: str, profile: str, seed: int, seconds: float | None) -> Iterator[Row]:
    """Simulate a clip and estimate it with the filter, the smoother and the optimiser."""
    recording = mj.simulate(load_clip(clip, seconds), profile=profile, seed=seed)
    filtered = mj.ekf(recording)
    yield _row(clip, filtered, recording)
    smoothed = mj.ekf(recording, options=mj.EkfOptions(smooth=True))
    yield _row(clip, smoothed, recording)
    yield _row(clip, mj.optimise(recording, initial=smoothed), recording)


def _row(clip: str, solution: mj.Solution, recording: mj.Recording) -> Row:
    squared = nees(solution, recording)
    return Row(
        Path(clip).name, solution.method, len(squared), joint_consistency(solution, recording),
        float(np.nanmean(squared)),
    )  # fmt: skip
