"""Where the body holds still at the start of a recording, and what its sensors read there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocap_jax.initialise.rest_options import RestOptions
from mocap_jax.recording import InertialStream, Recording


class Still(NamedTuple):
    """A still interval."""

    start: float
    """[s]"""
    end: float
    """[s]"""
    declared: bool
    """Whether the set-up declares it."""
    rate: float
    """RMS angular rate of all sensors in it, their means removed [rad/s]."""
    still: bool
    """Whether it may be used as a rest."""


def find_still(recording: Recording, options: RestOptions) -> Still:
    """The declared rest hold, or the stillest window at the start."""
    rest = recording.setup.rest
    if rest is not None:
        rate = rate_within(recording, rest.start, rest.end)
        return Still(rest.start, rest.end, True, rate, True)
    first = recording.interval[0]
    last = max(first + options.search - options.window, first)
    starts = np.arange(first, last + 1e-9, 0.05)
    rates = [rate_within(recording, s, s + options.window) for s in starts]
    best = int(np.argmin(rates))
    start = float(starts[best])
    return Still(
        start, start + options.window, False, rates[best], rates[best] < options.still_rate
    )


def within(stream: InertialStream, start: float, end: float) -> slice:
    """Samples of a stream inside an interval."""
    time = np.asarray(stream.time)
    return slice(int(np.searchsorted(time, start)), int(np.searchsorted(time, end, "right")))


def rate_within(recording: Recording, start: float, end: float) -> float:
    """RMS angular rate of all sensors, small constant offsets tolerated [rad/s]; inf without any.

    A biased board still looks still.
    """
    squares = []
    for stream in recording.inertial.values():
        rate = np.asarray(stream.gyroscope)[within(stream, start, end)]
        rate = rate[np.isfinite(rate).all(axis=1)]
        if len(rate):
            constant = np.clip(rate.mean(axis=0), -0.1, 0.1)
            squares.append(((rate - constant) ** 2).sum(axis=1).mean())
    return float(np.sqrt(np.mean(squares))) if squares else float("inf")
