"""`root_speed`, `doubtful_root`: a root in millimetres moves, or stands, a thousand times off."""

from __future__ import annotations

import numpy as np

from mocap_jax.recording.recording import Recording
from mocap_jax.recording.streams import RootStream

# Displacements over so long tell motion: from sample to sample, noise and stamps that come in
# bursts would outweigh it [s].
_WINDOW = 1.0
_MOST_WINDOWS = 100_000
# Faster than anybody on foot, though not than vehicles [m/s].
_HASTY = 15.0
# No room is so high; a pelvis, about a metre high, is in centimetres or millimetres [m].
_LOFTY, _MILLIMETRES = 30.0, 300.0


def root_speed(root: RootStream) -> float:
    """Median of how fast the root is displaced over windows of a second [m/s]; NaN if shorter."""
    position = np.asarray(root.position)
    there = np.isfinite(position).all(axis=1)
    time, position = np.asarray(root.time)[there], position[there]
    if len(time) < 2 or (span := float(time[-1] - time[0])) < _WINDOW:
        return np.nan
    # Of a clock that jumped by years there are no windows of a second: they would fill the memory.
    window = max(_WINDOW, span / _MOST_WINDOWS)
    at = time[0] + window * np.arange(int(span / window) + 1)
    places = np.stack([np.interp(at, time, x) for x in position.T], axis=1)
    return float(np.median(np.linalg.norm(np.diff(places, axis=0), axis=1))) / window


def doubtful_root(recording: Recording) -> tuple[str, ...]:
    """A root that moves or stands as nobody on foot does, in a sentence; empty if it does not.

    Vehicles move so, and altitudes are so high, hence this is no more than probably a fault.
    """
    root = recording.root
    if root is None:
        return ()
    if (speed := root_speed(root)) > _HASTY:
        return (
            f"The root's positions move at {speed:.3g} m/s in the median over seconds: on foot "
            "nobody does; they may be millimetres instead of metres.",
        )
    if abs(height := _height_in_room(root)) > _LOFTY:
        unit = "millimetres" if abs(height) > _MILLIMETRES else "centimetres"
        return (
            f"The root is {height:.4g} m above the world's origin in the median: unless that is an "
            f"altitude, its positions may be {unit} instead of metres.",
        )
    return ()


def _height_in_room(root: RootStream) -> float:
    """Median height above the world's origin [m]; NaN where it may be anything.

    Systems that measure orientations, too, have their origin in the room; receivers of satellites
    measure places alone, and altitudes among them.
    """
    height = np.asarray(root.position)[:, 2]
    both = np.isfinite(height) & np.isfinite(np.asarray(root.orientation)).all(axis=1)
    return float(np.median(height[both])) if both.any() else np.nan
