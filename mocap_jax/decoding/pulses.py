"""The pulses of a raw recording, as far as it has been read."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError
from mocap_jax.signals.wire import Emissions


class Pulses:
    """Times and sources of emissions.

    Args:
        bands: index of each source's frequency by the source's name; of others it is 0.
    """

    def __init__(self, bands: Mapping[str, int] | None = None) -> None:
        self._bands = bands or {}
        self._time = np.zeros(1024)
        self._source, self._band = np.zeros(1024, np.int64), np.zeros(1024, np.int64)
        self._count = 0
        self._last: dict[int, float] = {}
        self.names: list[str] = []

    def add(self, time: float, source: str) -> None:
        """Add the next one; those of different frequencies may sound at the same time.

        Raises:
            InputError: it is earlier than the one before, or one of its frequency sounds then.
        """
        n, band = self._count, self._bands.get(source, 0)
        if n and (time < self._time[n - 1] or time <= self._last.get(band, -np.inf)):
            raise InputError(f"/pulse: {time:.6f} s comes behind {self._time[n - 1]:.6f} s")
        if source not in self.names:
            self.names.append(source)
        if n == len(self._time):  # Views that were handed out stay what they are.
            none = np.zeros(n, np.int64)
            self._time = np.concatenate([self._time, np.zeros(n)])
            self._source = np.concatenate([self._source, none])
            self._band = np.concatenate([self._band, none])
        self._time[n], self._source[n] = time, self.names.index(source)
        self._band[n], self._last[band] = band, time
        self._count = n + 1

    @property
    def time(self) -> Float[np.ndarray, "n"]:
        """[s]"""
        return self._time[: self._count]

    @property
    def emissions(self) -> Emissions:
        """All of them, for wires."""
        return Emissions(self.time, self._band[: self._count])

    def missing(self, interval: float) -> int:
        """How many pulses are not there although those before and behind of their frequency are.

        Args:
            interval: between pulses of one frequency [s].
        """
        every = self.emissions
        gaps = (np.diff(every.time[every.band == band]) / interval for band in self._last)
        return sum(int(np.maximum(np.rint(gap) - 1, 0).sum()) for gap in gaps)

    def sources(self, order: tuple[str, ...]) -> tuple[np.ndarray, tuple[str, ...]]:
        """Index of each pulse's source, and the names: those declared first."""
        names = tuple(dict.fromkeys([*order, *self.names]))
        place = np.array([names.index(n) for n in self.names], np.int64)
        own = self._source[: self._count]
        return (place[own] if own.size else own), names
