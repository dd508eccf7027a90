"""Motions drawn from the optimiser's own prior: its covariance must then be right.

A few runs only; `scripts/check_consistency` does a hundred.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from checks.consistency import run

RUNS, SECONDS, FREEDOMS = 10, 0.7, 10


@pytest.mark.slow
def test_errors_are_as_large_as_claimed() -> None:
    runs = [run(100 + seed, seconds=SECONDS) for seed in range(RUNS)]
    assert all(r.status.ok for r in runs)
    nees = np.stack([r.nees for r in runs])
    # Runs are independent, frames of a run are not: bounds are those of a single frame's errors,
    # wider than those of the mean over frames can be.
    low, high = chi2.ppf([0.001, 0.999], RUNS * FREEDOMS) / (RUNS * FREEDOMS)
    assert low < nees.mean() < high
    for frame in (0, nees.shape[1] // 2, nees.shape[1] - 1):
        assert low < nees[:, frame].mean() < high
    # Without the covariance of neighbours this would be far too small.
    assert low < np.mean([r.velocity for r in runs]) < high
