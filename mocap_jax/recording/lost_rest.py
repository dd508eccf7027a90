"""`in_gap`, `without_lost_rest`: whether a rest hold was measured at all."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.recording.cut import SHORTEST_REST
from mocap_jax.recording.recording import Recording
from mocap_jax.recording.streams import InertialStream

# Where no board says another [s].
_FRAME = 1 / 120
# Samples farther apart have a gap between them: frames or pulses that were lost do not part a hold,
# longer silence does [s], [frames].
_GAP, _GAP_FRAMES = 0.1, 5
# Less than this of a hold is as good as nothing [s].
_LEAST = 0.1


def without_lost_rest(recording: Recording) -> tuple[Recording, str]:
    """Drop a declared rest hold of which less than 0.5 s was measured, as `cut` does.

    Returns:
        The recording, and what to say of it; empty where the hold is kept.
    """
    rest = recording.setup.rest
    if rest is None:
        return recording, ""
    if _measured(recording, rest.start, rest.end) >= min(SHORTEST_REST, rest.end - rest.start):
        return recording, ""
    setup = dataclasses.replace(recording.setup, rest=None)
    return dataclasses.replace(recording, setup=setup), (
        f"the rest hold ({rest.start:g} to {rest.end:g} s) is lost: offsets and mounting of the "
        "sensors cannot be read from it"
    )


def in_gap(recording: Recording, start: float, end: float) -> bool:
    """Whether nothing, or hardly anything, was measured in a time [s] within the recording."""
    return _measured(recording, start, end) < min(_LEAST, end - start)


def _measured(recording: Recording, start: float, end: float) -> float:
    """How much of a time was measured by any board, up to a frame [s]; -inf for nothing of it.

    Samples are stamped at the centres of their intervals, so a time reaches beyond them; gaps in it
    count as not measured, rows of NaN as gaps. Of a recording without boards ranges and root count.
    """
    boards = [_board_times(s) for s in recording.inertial.values()]
    steps = [float(np.median(np.diff(t))) for t in boards if len(t) > 1]
    frame = min(steps, default=_FRAME)
    others = [s for s in (recording.ranges, recording.root) if s is not None]
    streams = boards or [np.asarray(s.time) for s in others]
    within = [t[(t >= start - frame) & (t <= end + frame)] for t in streams]
    time = np.sort(np.concatenate([*within, np.zeros(0)]))
    if not len(time):
        return -np.inf
    step = np.diff(np.clip(time, start, end))
    gaps = step[np.diff(time) > max(_GAP, _GAP_FRAMES * frame)].sum()
    return float(min(end, time[-1]) - max(start, time[0]) - gaps + 2 * frame)


def _board_times(stream: InertialStream) -> np.ndarray:
    """Stamps of the samples at which a board read anything."""
    readings = np.hstack([stream.accelerometer, stream.gyroscope, stream.orientation])
    return np.asarray(stream.time)[np.isfinite(readings).any(axis=1)]
