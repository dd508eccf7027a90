"""`without_lost_rest`: a damaged file whose rest hold is among what was lost."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.recording.cut import SHORTEST_REST
from mocap_jax.recording.recording import Recording

# Where no board says another [s].
_FRAME = 1 / 120


def without_lost_rest(recording: Recording) -> tuple[Recording, str]:
    """Drop a declared rest hold of which less than 0.5 s was measured, as `cut` does.

    Returns:
        The recording, and what to say of it; empty where the hold is kept.
    """
    rest = recording.setup.rest
    if rest is None or measured_rest(recording) >= min(SHORTEST_REST, rest.end - rest.start):
        return recording, ""
    setup = dataclasses.replace(recording.setup, rest=None)
    return dataclasses.replace(recording, setup=setup), (
        f"the rest hold ({rest.start:g} to {rest.end:g} s) is lost: offsets and mounting of the "
        "sensors cannot be read from it"
    )


def measured_rest(recording: Recording) -> float:
    """How much of the declared rest hold was measured, up to a frame [s]; -inf for nothing of it.

    Samples are stamped at the centres of their intervals, so a hold reaches beyond them.
    """
    rest = recording.setup.rest
    if rest is None:
        return -np.inf
    boards = [np.asarray(s.time) for s in recording.inertial.values()]
    steps = [float(np.median(np.diff(t))) for t in boards if len(t) > 1]
    frame = min(steps, default=_FRAME)
    others = [s for s in (recording.ranges, recording.root) if s is not None]
    streams = boards or [np.asarray(s.time) for s in others]
    within = [t[(t >= rest.start - frame) & (t <= rest.end + frame)] for t in streams]
    time = np.concatenate([*within, np.zeros(0)])
    if not len(time):
        return -np.inf
    first, last = float(time.min()), float(time.max())
    return min(rest.end, last) - max(rest.start, first) + 2 * frame
