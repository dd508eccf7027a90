"""Mean readings of steady intervals, and which axis they are along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.recording import InertialStream

DIRECTIONS = ("+x", "-x", "+y", "-y", "+z", "-z")
_ALONG = 0.9
"""Cosine from which a reading counts as along an axis (26 degrees)."""
_BATCHES = 8


@dataclass(frozen=True)
class Plateau:
    """A sensor's readings in one steady interval."""

    start: float
    """[s]"""
    end: float
    """[s]"""
    mean: Float[np.ndarray, "3"]
    """Of the readings [m/s^2 or rad/s]."""
    sigma: Float[np.ndarray, "3"]
    """Standard deviation of that mean, from the means of eight parts: drift counts."""
    place: str = ""
    """Recording it is from."""

    @property
    def direction(self) -> str | None:
        """The axis it is along, "+x" to "-z"; None where it is along none."""
        axis = int(np.argmax(np.abs(self.mean)))
        if abs(self.mean[axis]) < _ALONG * np.linalg.norm(self.mean):
            return None
        return DIRECTIONS[2 * axis + int(self.mean[axis] < 0)]


def plateau(stream: InertialStream, kind: str, rows: slice, place: str) -> Plateau:
    """Readings of an interval.

    Args:
        stream: a board's samples.
        kind: "accelerometer" or "gyroscope".
        rows: samples of the interval.
        place: name of the recording.
    """
    time = np.asarray(stream.time)[rows]
    values = np.asarray(getattr(stream, kind))[rows]
    values = values[np.isfinite(values).all(axis=1)]
    parts = np.array([part.mean(axis=0) for part in np.array_split(values, _BATCHES)])
    sigma = parts.std(axis=0, ddof=1) / np.sqrt(_BATCHES)
    return Plateau(float(time[0]), float(time[-1]), values.mean(axis=0), sigma, place)
