"""The simulated recordings that are measured on: 18 boards, 8 sources, `paper` profile."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np

import mocap_jax as mj
from mocap_jax.motion import Motion
from mocap_jax.recording import Recording
from mocap_jax.simulation import SimulationOptions

PROFILE = "paper"
SEED = 0


@cache
def walking() -> Recording:
    """The built-in walking clip, whole (about 14 s)."""
    return mj.simulate(mj.builtin_motion("walking"), profile=PROFILE, seed=SEED)


def of_duration(seconds: float, clip: str = "walking") -> Recording:
    """A recording that lasts about so long, rest hold and blend included."""
    motion = mj.builtin_motion(clip)
    options = SimulationOptions()
    wanted = seconds - options.rest_s - options.blend_s
    recording = mj.simulate(_lasting(motion, wanted), profile=PROFILE, seed=SEED)
    start, end = recording.interval
    # The blend takes longer where joints travel far: cut the clip by what came on top.
    excess = (end - start) - seconds
    if excess > 0.05:
        motion = _lasting(motion, wanted - excess)
        recording = mj.simulate(motion, profile=PROFILE, seed=SEED)
    return recording


def _lasting(motion: Motion, seconds: float) -> Motion:
    """A clip cut to, or played forwards and backwards for, so many seconds."""
    path = motion.trajectory
    time, q = np.asarray(path.time), np.asarray(path.q)
    step = time[1] - time[0]
    count = round(seconds / step) + 1
    turns = 2 * len(q) - 2
    row = np.arange(count) % turns
    row = np.where(row < len(q), row, turns - row)
    looped = dataclasses.replace(path, time=step * np.arange(count), q=q[row], v=None)
    return dataclasses.replace(motion, trajectory=looped)


def size(recording: Recording) -> dict[str, int]:
    """Boards and sources of a recording."""
    sources = 0 if recording.ranges is None else len(recording.ranges.source_names)
    return {"boards": len(recording.inertial), "sources": sources}
