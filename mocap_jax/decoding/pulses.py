"""The pulses of a raw recording, as far as it has been read."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError


class Pulses:
    """Times and sources of emissions."""

    def __init__(self) -> None:
        self._time, self._source = np.zeros(1024), np.zeros(1024, np.int64)
        self._count = 0
        self.names: list[str] = []

    def add(self, time: float, source: str) -> None:
        """Add the next one.

        Raises:
            InputError: it is earlier than the one before.
        """
        n = self._count
        if n and time <= self._time[n - 1]:
            raise InputError(f"/pulse: {time:.6f} s comes behind {self._time[n - 1]:.6f} s")
        if source not in self.names:
            self.names.append(source)
        if n == len(self._time):  # Views that were handed out stay what they are.
            self._time = np.concatenate([self._time, np.zeros(n)])
            self._source = np.concatenate([self._source, np.zeros(n, np.int64)])
        self._time[n], self._source[n] = time, self.names.index(source)
        self._count = n + 1

    @property
    def time(self) -> Float[np.ndarray, "n"]:
        """[s]"""
        return self._time[: self._count]

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
        own = self._source[: self._count]
        return (place[own] if own.size else own), names
