"""A rest hold stays as it is while enough of it was measured, and goes whole otherwise."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from cut_samples import recording, rows

from mocap_jax.recording import InertialStream, Recording, RestHold, without_lost_rest


def measured(rest: RestHold | None, *stretches: tuple[float, float]) -> Recording:
    time = np.concatenate([np.arange(a, b, 0.01) + 0.005 for a, b in stretches])
    board = InertialStream(time, rows(time, 3), rows(time, 3), rows(time, 4))
    return dataclasses.replace(recording(rest), inertial={"a": board})


@pytest.mark.parametrize(
    ("rest", "stretches"),
    [
        (None, [(0, 5)]), (RestHold(0.0, 2.0), [(0, 5)]), (RestHold(0.0, 2.0), [(1, 5)]),
        (RestHold(0.0, 0.2), [(0, 5)]), (RestHold(0.0, 0.0), [(0, 5)]),
        (RestHold(0.0, 2.0), [(0, 0.6), (3, 5)]), (RestHold(0.0, 2.0), [(0, 0.3), (1.7, 5)]),
    ],
)  # fmt: skip
def test_kept(rest: RestHold | None, stretches: list[tuple[float, float]]) -> None:
    whole = measured(rest, *stretches)
    same, told = without_lost_rest(whole)
    assert same is whole and not told


@pytest.mark.parametrize(
    ("rest", "stretches"),
    [
        (RestHold(0.0, 2.0), [(3, 5)]), (RestHold(0.0, 2.0), [(1.7, 5)]),
        (RestHold(0.0, 0.2), [(0.15, 5)]), (RestHold(0.0, 0.0), [(1, 5)]),
        (RestHold(1.0, 2.0), [(0, 0.9), (2.1, 5)]), (RestHold(1.0, 2.0), [(0, 1.0), (2.0, 5)]),
        (RestHold(0.0, 2.0), [(0, 0.2), (1.8, 5)]),
    ],
)  # fmt: skip
def test_dropped(rest: RestHold, stretches: list[tuple[float, float]]) -> None:
    less, told = without_lost_rest(measured(rest, *stretches))
    assert less.setup.rest is None
    assert told.startswith(f"the rest hold ({rest.start:g} to {rest.end:g} s) is lost")


def test_rows_without_a_reading_are_a_gap() -> None:
    whole = measured(RestHold(1.0, 2.0), (0, 5))
    (board,) = whole.inertial.values()
    within = (board.time > 0.9) & (board.time < 2.1)
    for name in ("accelerometer", "gyroscope", "orientation"):
        getattr(board, name)[within] = np.nan
    assert without_lost_rest(whole)[0].setup.rest is None
    board.orientation[within] = 0.5  # one kind of reading is enough
    assert without_lost_rest(whole)[0] is whole
