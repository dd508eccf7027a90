"""How far a recording reaches, and whether a frame grid over it makes sense."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.recording.recording import Recording

# Frames are made for pauses as well. So many empty ones in a row (24 minutes at 140 Hz) would fill
# the memory; they are a clock that jumped, or sessions that were joined.
_MOST_EMPTY_FRAMES = 200_000
_FEWEST_FRAMES = 4
# Of the frame grid where no board says another [Hz].
_RATE_WITHOUT_BOARDS = 120.0


class Extent(NamedTuple):
    """Where a uniform frame grid starts and ends, and its rate."""

    start: float
    """[s]"""
    end: float
    """[s]"""
    rate_hz: float

    @property
    def frames(self) -> int:
        """Number of frames."""
        return int(np.floor((self.end - self.start) * self.rate_hz + 1e-3)) + 1


def frame_extent(recording: Recording, rate_hz: float | None = None) -> Extent:
    """From the first inertial sample to the last; of all streams where there are no such.

    Args:
        recording: its streams must not be empty, nor their times run backwards.
        rate_hz: of the grid; default the highest inertial rate (or 120 Hz without inertial data).

    Raises:
        InputError: fewer than four frames, or a pause of more than 200 000 of them in which
            nothing at all was measured.
    """
    streams = [np.asarray(s.time) for s in recording.inertial.values() if len(s.time) > 1]
    if rate_hz is None:
        steps = [float(np.median(np.diff(t))) for t in streams]
        rate_hz = 1.0 / min(steps) if steps else _RATE_WITHOUT_BOARDS
    if streams:
        start, end = min(float(t[0]) for t in streams), max(float(t[-1]) for t in streams)
    else:
        start, end = recording.interval
    extent = Extent(start, end, rate_hz)
    if extent.frames < _FEWEST_FRAMES:
        raise InputError(
            f"what was measured spans {end - start:.3f} s, fewer than {_FEWEST_FRAMES} frames at "
            f"{rate_hz:g} Hz"
        )
    _refuse_pause(recording, extent)
    return extent


def _refuse_pause(recording: Recording, extent: Extent) -> None:
    limit = _MOST_EMPTY_FRAMES / extent.rate_hz
    pauses = [(extent.start, extent.end)] if extent.end - extent.start > limit else []
    times = [np.asarray(board.time) for board in recording.inertial.values()]
    times += [np.asarray(field.time) for field in recording.magnetic.values()]
    times += [np.asarray(s.time) for s in (recording.ranges, recording.root) if s is not None]
    for time in times:
        if not pauses:  # as a rule after the first stream
            return
        pauses = [part for pause in pauses for part in _unmeasured(time, *pause, limit)]
    if pauses:
        first, last = max(pauses, key=lambda pause: pause[1] - pause[0])
        raise InputError(
            f"nothing was measured for {last - first:.0f} s, from {first:.2f} s to {last:.2f} s: "
            f"{(last - first) * extent.rate_hz:.0f} empty frames at {extent.rate_hz:.4g} Hz (at "
            f"most {_MOST_EMPTY_FRAMES}); a clock that jumped, or recordings that were joined: cut "
            "out one stretch (mocap-jax cut --from S --to S, or mj.cut)"
        )


def _unmeasured(
    time: np.ndarray, first: float, last: float, limit: float
) -> list[tuple[float, float]]:
    """The parts of a pause, longer than the limit [s], that a stream's times leave of it."""
    inside = time[np.searchsorted(time, first, "right") : np.searchsorted(time, last, "left")]
    edges = np.concatenate([[first], inside, [last]])
    wide = np.flatnonzero(np.diff(edges) > limit)
    return [(float(edges[i]), float(edges[i + 1])) for i in wide]
