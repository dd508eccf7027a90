"""`scripts/clips`: the beginning of a clip is cut as everybody cuts motions."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import mocap_jax as mj

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from clips import load_clip


def test_the_beginning_of_a_clip() -> None:
    whole, part = load_clip("walking"), load_clip("walking", 1.0)
    wanted = mj.cut_motion(whole, 0.0, 1.0)
    assert (part.name, part.facts) == (wanted.name, wanted.facts)
    np.testing.assert_array_equal(part.trajectory.q, wanted.trajectory.q)
    assert len(part.trajectory.time) < len(whole.trajectory.time)
