"""The pulses of a raw recording, as far as it has been read."""

from __future__ import annotations

from array import array

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError


class Pulses:
    """Times and sources of emissions."""

    def __init__(self) -> None:
        self._time, self._source = array("d"), array("q")
        self.names: list[str] = []

    def add(self, time: float, source: str) -> None:
        """Add the next one.

        Raises:
            InputError: it is earlier than the one before.
        """
        if self._time and time <= self._time[-1]:
            raise InputError(f"/pulse: {time:.6f} s comes behind {self._time[-1]:.6f} s")
        if source not in self.names:
            self.names.append(source)
        self._time.append(time)
        self._source.append(self.names.index(source))

    @property
    def time(self) -> Float[np.ndarray, "n"]:
        """[s]"""
        return np.array(self._time, np.float64)

    def missing(self, interval: float) -> int:
        """How many pulses are not there although the pulses before and behind are.

        Args:
            interval: between pulses [s].
        """
        return int(np.maximum(np.rint(np.diff(self.time) / interval) - 1, 0).sum())

    def sources(self, order: tuple[str, ...]) -> tuple[np.ndarray, tuple[str, ...]]:
        """Index of each pulse's source, and the names: those declared first."""
        names = tuple(dict.fromkeys([*order, *self.names]))
        place = np.array([names.index(n) for n in self.names], np.int64)
        own = np.array(self._source, np.int64)
        return (place[own] if own.size else own), names
