"""Sensors that do not cover their recording are named."""

import dataclasses

import numpy as np
from cut_samples import recording, rows

from mocap_jax.recording import InertialStream, ragged_ends


def board(start: float, stop: float, rate: float = 100.0) -> InertialStream:
    time = np.arange(start, stop, 1 / rate)
    return InertialStream(time, rows(time, 3), rows(time, 3), rows(time, 4))


def told(**boards: InertialStream) -> tuple[str, ...]:
    return ragged_ends(dataclasses.replace(recording(), inertial=boards))


def test_even_ends_and_small_differences_are_not_told():
    assert not told(a=board(0, 10), b=board(0.05, 9.95), c=board(0.4, 10, rate=5))
    assert not told(a=board(0, 10)) and not told()


def test_late_starts_and_early_ends_are_told_once_for_all_alike():
    lines = told(a=board(0, 10), b=board(2, 10), c=board(2, 10), d=board(0, 3))
    assert lines == (
        "Sensors b, c: samples start at 2.00 s, after others at 0.00 s.",
        "Sensor d: samples end at 2.99 s, before others at 9.99 s.",
    )
