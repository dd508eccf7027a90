"""Sources on a ceiling as the root's absolute reference: simulated by C MuJoCo, root free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wanderers import wanderer, worn

import mocap_jax as mj
from mocap_jax.initialise import RestOptions
from mocap_jax.recording import Recording
from mocap_jax.simulation import Anchor, simulate

DOWN = (0.0, 1.0, 0.0, 0.0)
CEILING = tuple(
    Anchor(f"ceiling{i}", (x, y, 2.6), DOWN, emits=True)
    for i, (x, y) in enumerate(((1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)))
)
FREE = mj.EkfOptions(kinds="AGD", root="free")
SECONDS = 10.0


def root_error(solution: mj.Solution, recording: Recording, first: int = 0) -> np.ndarray:
    """Distance of an estimated root from the true one, by frame [m]."""
    truth = recording.truth.trajectory
    at = np.asarray(solution.trajectory.time)
    true = [np.interp(at, truth.time, truth.q[:, first + k]) for k in range(3)]
    return np.linalg.norm(np.asarray(solution.trajectory.q)[:, first : first + 3].T - true, axis=0)


@pytest.fixture(scope="module")
def anchored() -> Recording:
    suit = replace(worn(), anchors=CEILING)
    return simulate(wanderer(SECONDS), profile="paper", suit=suit, seed=1)


def test_a_free_root_drifts_without_anchors_and_does_not_with_them(anchored: Recording) -> None:
    alone = simulate(wanderer(SECONDS), profile="paper", suit=worn(), seed=1)
    drifting = root_error(mj.ekf(alone, options=FREE), alone)
    held = root_error(mj.ekf(anchored, options=FREE), anchored)
    n = len(held) // 4
    assert drifting[-n:].min() > 0.1 and drifting[-n:].mean() > 3 * drifting[n : 2 * n].mean()
    assert held[n:].max() < 0.02
    assert held[-n:].mean() < 1.5 * held[n : 2 * n].mean()


def test_a_person_away_from_where_the_file_says_is_found(anchored: Recording) -> None:
    """The reference is absolute: not only changes since a known start."""
    rest = anchored.setup.rest
    away = np.array(rest.pose["root"]) + [0.3, -0.2, 0.1, 0, 0, 0, 0]
    setup = replace(
        anchored.setup, rest=replace(rest, pose={**rest.pose, "root": tuple(away.tolist())})
    )
    moved = replace(anchored, setup=setup, root=None)
    options = replace(FREE, smooth=True, rest=RestOptions(root_position_sigma=0.5))
    filtered = mj.ekf(moved, options=options)
    error = root_error(filtered, anchored)
    assert error[len(error) // 2 :].max() < 0.03
    best = mj.optimise(
        moved, initial=filtered, options=mj.OptimiseOptions(kinds="AGD", root="free")
    )
    assert root_error(best, anchored).max() < 0.01
