"""`cut_motion`: a stretch of a motion."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.motion.motion import Motion

# What the simulation's low-pass and the placement's scenes need.
_LEAST_FRAMES = 8


def cut_motion(motion: Motion, start: float, stop: float) -> Motion:
    """The stretch of a motion from one time to another, both included.

    Its time starts at zero; name and facts say where it was cut (`cut_start`, `cut_stop`).

    Args:
        motion: to be cut.
        start: [s] after its first frame.
        stop: [s] after its first frame.

    Raises:
        InputError: fewer than 8 frames lie between these times.
    """
    path = motion.trajectory
    time = np.asarray(path.time) - float(path.time[0])
    # Times of frames are rounded: a frame at the very end of the stretch belongs to it.
    kept = (time >= start - 1e-9) & (time <= stop + 1e-9)
    if kept.sum() < _LEAST_FRAMES:
        raise InputError(
            f"{motion.name}:{start:g}-{stop:g}: no such stretch; the motion lasts {time[-1]:.2f} s "
            f"(at least {_LEAST_FRAMES} frames are needed)"
        )
    shorter = dataclasses.replace(
        path,
        time=jax.device_put(time[kept] - time[kept][0]),
        q=jax.device_put(np.asarray(path.q)[kept]),
        v=None if path.v is None else jax.device_put(np.asarray(path.v)[kept]),
    )
    return dataclasses.replace(
        motion,
        name=f"{motion.name}:{start:g}-{stop:g}",
        trajectory=shorter,
        facts={**motion.facts, "cut_start": float(start), "cut_stop": float(stop)},
    )
