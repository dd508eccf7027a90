"""`cut`: a stretch of a recording."""

from __future__ import annotations

import dataclasses
import math
from typing import TypeVar

import jax
import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.recording.recording import Recording, Truth
from mocap_jax.recording.setup import RestHold, Setup
from mocap_jax.recording.streams import TemperatureStream

CUT_START, CUT_STOP = "cut_start", "cut_stop"
"""Facts of the provenance of a cut recording: the times it was cut at [s]."""
# A shorter piece of a rest hold tells offsets and mounting too badly to count as one [s].
SHORTEST_REST = 0.5
_Stream = TypeVar("_Stream")


def cut(recording: Recording, start: float | None = None, stop: float | None = None) -> Recording:
    """The stretch of a recording from one time to another, both included.

    Times stay what they are, seconds since the start of the whole recording, so that the stretch
    and what is estimated from it can be compared with the whole and its truth. Every stream is cut;
    sensors that measured nothing in the stretch are left out. The truth reaches to the first pose
    outside on either side, so that all measurements lie within it. A rest hold keeps what lies
    inside, and is dropped where that is less than 0.5 s: without one, offsets and mounting keep
    their nominal values. The provenance tells the times (`cut_start`, `cut_stop`).

    Args:
        recording: to be cut.
        start: first time kept [s]; None for the beginning.
        stop: last time kept [s]; None for the end.

    Raises:
        InputError: times that are not finite or not in order, or between which nothing was
            measured.
    """
    first, last = recording.interval
    low, high = (float(d if x is None else x) for x, d in ((start, first), (stop, last)))
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"cut: {low:g} s to {high:g} s: expected finite times")
    if low > last or high < first:
        asked = f"from {low:g} s on" if stop is None else f"between {low:g} s and {high:g} s"
        raise InputError(f"cut: nothing {asked}: the recording has {first:.2f} s to {last:.2f} s")
    if low >= high:
        raise InputError(f"cut: {low:g} s to {high:g} s: the start must be before the end")
    ranges, root = recording.ranges, recording.root
    shorter = dataclasses.replace(
        recording,
        inertial=_of_each(recording.inertial, low, high),
        magnetic=_of_each(recording.magnetic, low, high),
        ranges=None if ranges is None else _part(ranges, low, high),
        root=None if root is None else _some(_part(root, low, high)),
        temperature=_air(recording.temperature, low, high),
        truth=None if recording.truth is None else _true_part(recording.truth, low, high),
    )
    if not _measured(shorter):
        raise InputError(f"cut: no sensor measured anything between {low:g} s and {high:g} s")
    # An end that is not cut leaves the hold as it is: its samples are stamped inside of it.
    rest = _rest(
        recording.setup.rest,
        -math.inf if start is None else low,
        math.inf if stop is None else high,
    )
    return dataclasses.replace(shorter, setup=_declared(shorter, rest, low, high))


def _of_each(streams: dict[str, _Stream], low: float, high: float) -> dict[str, _Stream]:
    """The parts of streams by sensor, without those that are empty."""
    parts = {name: _some(_part(stream, low, high)) for name, stream in streams.items()}
    return {name: part for name, part in parts.items() if part is not None}


def _part(stream: _Stream, low: float, high: float) -> _Stream:
    """Samples within; every array of a stream has one row a sample."""
    time = np.asarray(stream.time)  # type: ignore[attr-defined]
    return _rows(stream, (time >= low) & (time <= high))


def _rows(stream: _Stream, chosen: np.ndarray) -> _Stream:
    # In NumPy: JAX would compile an indexing operation for every length.
    return jax.tree.map(lambda x: jax.device_put(np.asarray(x)[chosen]), stream)


def _some(stream: _Stream) -> _Stream | None:
    return stream if len(stream.time) else None  # type: ignore[attr-defined]


def _air(stream: TemperatureStream | None, low: float, high: float) -> TemperatureStream | None:
    """Temperatures, from the last one before on: they are measured seldom."""
    if stream is None:
        return None
    time = np.asarray(stream.time)
    return _some(_rows(stream, _reaching(time, low, high) & (time <= high)))


def _true_part(truth: Truth, low: float, high: float) -> Truth | None:
    """Poses from the last one before to the first one after, and what is told for each of them."""
    time = np.asarray(truth.trajectory.time)
    chosen = _reaching(time, low, high)
    if not chosen.any():
        return None
    parameters = {
        name: jax.device_put(np.asarray(x)[chosen]) if np.shape(x)[:1] == time.shape else x
        for name, x in truth.parameters.items()
    }
    return dataclasses.replace(
        truth, trajectory=_rows(truth.trajectory, chosen), parameters=parameters
    )


def _reaching(time: np.ndarray, low: float, high: float) -> np.ndarray:
    """Which times lie within or next to it."""
    first = np.searchsorted(time, low, side="right") - 1
    last = np.searchsorted(time, high, side="left")
    at = np.arange(len(time))
    return (at >= first) & (at <= last) & (last >= 0) & (first < len(time))


def _measured(recording: Recording) -> bool:
    ranges = recording.ranges
    return bool(recording.inertial) or (ranges is not None and len(ranges.time) > 0)


def _declared(shorter: Recording, rest: RestHold | None, low: float, high: float) -> Setup:
    """The set-up of the stretch: its sensors, its part of the rest hold, where it was cut."""
    setup = shorter.setup
    measuring = {*shorter.inertial, *shorter.magnetic}
    heard = shorter.ranges
    if heard is not None and len(heard.time):
        measuring |= {heard.receiver_names[i] for i in np.unique(np.asarray(heard.receiver))}
    return dataclasses.replace(
        setup,
        sensors=tuple(s for s in setup.sensors if s.name in measuring),
        rest=rest,
        provenance={**setup.provenance, CUT_START: low, CUT_STOP: high},
    )


def _rest(rest: RestHold | None, low: float, high: float) -> RestHold | None:
    if rest is None:
        return None
    start, end = max(rest.start, low), min(rest.end, high)
    # A hold that is declared shorter than that stays one, if it is whole.
    if end - start < min(SHORTEST_REST, rest.end - rest.start):
        return None
    return dataclasses.replace(rest, start=start, end=end)
