"""Shapes of streams, checked before they are written: a file would hide what is wrong with them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.io.topics import INERTIAL, MAGNETIC, RANGE, ROOT, TEMPERATURE
from mocap_jax.recording import Recording

_WIDTH = {"orientation": 4, "accelerometer": 3, "gyroscope": 3, "field": 3, "position": 3}


def check_shapes(recording: Recording) -> None:
    """Check that every stream has one row for each of its times.

    Raises:
        InputError: naming the topic, the array, its shape and the expected one.
    """
    for topic, stream, names in _streams(recording):
        time = np.asarray(stream.time)
        if time.ndim != 1:
            raise InputError(f"{topic}: time has shape {time.shape}, expected (n,)")
        for name in names:
            shape = np.shape(getattr(stream, name))
            expected = (len(time), _WIDTH[name]) if name in _WIDTH else (len(time),)
            if shape != expected:
                raise InputError(f"{topic}: {name} has shape {shape}, expected {expected}")


def _streams(recording: Recording) -> Iterator[tuple[str, Any, tuple[str, ...]]]:
    """Topic, stream and names of its arrays."""
    for sensor, board in recording.inertial.items():
        yield INERTIAL + sensor, board, ("orientation", "gyroscope", "accelerometer")
    for sensor, field in recording.magnetic.items():
        yield MAGNETIC + sensor, field, ("field",)
    if recording.ranges is not None:
        yield RANGE, recording.ranges, ("source", "receiver", "distance", "confidence")
    if recording.root is not None:
        yield ROOT, recording.root, ("position", "orientation")
    if recording.temperature is not None:
        yield TEMPERATURE, recording.temperature, ("celsius",)
