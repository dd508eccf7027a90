"""Mean readings of all sensors over a still interval."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mocap_jax.initialise.still import Still, within
from mocap_jax.recording import Recording


class RestReadings(NamedTuple):
    """Means over the interval, NaN where nothing was measured, and how many samples they hold."""

    force: Float[np.ndarray, "s 3"]
    rate: Float[np.ndarray, "s 3"]
    orientation: Float[np.ndarray, "s 4"]
    count: Float[np.ndarray, "s"]
    root_position: Float[np.ndarray, "3"]
    root_orientation: Float[np.ndarray, "4"]
    root_count: int


def rest_readings(recording: Recording, still: Still, use_root: bool) -> RestReadings:
    """Average every stream over the interval."""
    force, rate, orientation, count = [], [], [], []
    for stream in recording.inertial.values():
        part = within(stream, still.start, still.end)
        rows = np.asarray(stream.accelerometer)[part]
        force.append(_mean(rows))
        rate.append(_mean(np.asarray(stream.gyroscope)[part]))
        orientation.append(_mean_quaternion(np.asarray(stream.orientation)[part]))
        count.append(max(int(np.isfinite(rows).all(axis=1).sum()), 1))
    position, quat, root_count = np.full(3, np.nan), np.full(4, np.nan), 0
    if use_root and recording.root is not None:
        time = np.asarray(recording.root.time)
        held = (time >= still.start) & (time <= still.end)
        position = _mean(np.asarray(recording.root.position)[held])
        quat = _mean_quaternion(np.asarray(recording.root.orientation)[held])
        root_count = int(held.sum())
    return RestReadings(
        np.reshape(force, (-1, 3)),
        np.reshape(rate, (-1, 3)),
        np.reshape(orientation, (-1, 4)),
        np.asarray(count, float),
        position,
        quat,
        root_count,
    )


def _mean(rows: np.ndarray) -> np.ndarray:
    rows = rows[np.isfinite(rows).all(axis=1)]
    return rows.mean(axis=0) if len(rows) else np.full(rows.shape[1], np.nan)


def _mean_quaternion(quats: np.ndarray) -> np.ndarray:
    """Mean rotation: the dominant eigenvector of the quaternions' scatter (Markley 2007)."""
    quats = quats[np.isfinite(quats).all(axis=1)]
    if not len(quats):
        return np.full(4, np.nan)
    return np.linalg.eigh(quats.T @ quats)[1][:, -1]
