"""`scripts/check_ranging`: its measures on few pulses."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from checks.ranging_confidence import Heard
from checks.ranging_noise import bound, level, noise_of
from checks.ranging_rig import PLACES, SOURCES, calibration


@pytest.mark.parametrize(("detector", "most"), [("matched", 1.2), ("inflection", 1.5)])
def test_simulated_waveforms_are_ranged_near_the_bound(detector: str, most: float):
    found = level(detector, 30.0, blocks=4, seed=1)
    assert found.lost == 0 and 0.85 < found.rmse / found.bound < most


def test_the_bound_follows_the_noise_and_pulses_drown_in_it():
    assert bound(20.0) == pytest.approx(10.0 * bound(40.0))
    assert noise_of(20.0) == pytest.approx(10.0 * noise_of(40.0))
    assert level("matched", 5.0, blocks=1, seed=0).lost > 0.5


@pytest.mark.parametrize("detector", ["matched", "inflection"])
def test_calibration_leaves_less_than_the_paper(detector: str):
    found = calibration(detector, seed=3)
    assert len(found.left_out_error) == SOURCES * PLACES
    assert np.ptp(found.offset) > 0.002  # there was something to calibrate
    assert found.mean_error < 0.00235 and found.error_deviation < 0.00192


def test_shares_and_deviations_by_confidence():
    rng = np.random.default_rng(0)
    error = np.concatenate([0.002 * rng.standard_normal(4000), 0.005 * rng.standard_normal(4000)])
    confidence = np.repeat([0.95, 0.55], 4000)
    error[:3] = 0.5
    scene = Heard(error, confidence, np.ones(8000, bool), 0.0025)
    assert scene.wrong(0.9) == (3, 4000) and scene.wrong(0.5)[1] == 8000
    (low, high, count, right, expected, found), (*_, best) = scene.bins()
    assert (low, high, count) == (0.5, 0.6, 4000)
    assert right == pytest.approx(0.954, abs=0.02) and expected == pytest.approx(0.0025 / 0.55)
    assert found == pytest.approx(0.005, rel=0.1) and best == pytest.approx(0.002, rel=0.1)
