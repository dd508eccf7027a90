"""Offsets of ultrasonic sources from distances that are known (Vlasic 2007, section 4.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.recording import Calibration, RangeStream, Recording, SourceOffset, uncalibrated
from mocap_jax.signals.ultrasonic.calibration import calibrate_offsets

_SIGMA_OF_MAD = 1.4826
_FAILED = 5.0
"""A distance whose excess is so many deviations from its source's median has failed: an echo, or a
source too near to be heard."""
_NEVER_FAILED = 5e-3
"""Less is no failure [m]."""
_ENOUGH = 5
"""Distances beside one for each source from which their scatter is known."""


@dataclass(frozen=True)
class KnownDistance:
    """What was measured of one pair of a source and a receiver that did not move."""

    source: str
    """Site of the source, or any name of a channel of its own offset."""
    true: float
    """By other means [m]."""
    measured: Float[np.ndarray, "n"]
    """Readings [m]; NaN where one is missing. Gross errors among them do no harm."""
    receiver: str = ""


@dataclass(frozen=True)
class SourceOffsets:
    """Offsets of sources, and how far each distance is off without and with them."""

    offsets: dict[str, SourceOffset]
    distances: tuple[KnownDistance, ...]
    """With a reading, in the order given."""
    raw_error: Float[np.ndarray, "n"]
    """Median reading less true distance, of each [m]."""
    left_out_error: Float[np.ndarray, "n"]
    """The same, corrected by the other distances of its source [m]; NaN where there is none."""
    scatter: Float[np.ndarray, "n"]
    """Deviation of the readings about their median (from the median absolute one) [m]."""
    failed: Bool[np.ndarray, "n"]
    """Distances that no offset rests on: far from what the others of their source say."""

    @property
    def calibration(self) -> Calibration:
        """For a set-up."""
        return Calibration(source_offset=self.offsets)


def calibrate_source_offsets(distances: Sequence[KnownDistance]) -> SourceOffsets:
    """Each source's offset: the mean excess over its distances, each the median of its readings.

    Every distance counts once, however many readings it has: what readings of one place have in
    common (echoes, how a source was held) they do not tell. Distances that have failed as a whole
    are left out, and out of what is said of other distances as well.

    Raises:
        InputError: no distance has a reading, or one is not a positive number.
    """
    for d in distances:
        if not (np.isfinite(d.true) and d.true > 0):
            raise InputError(f"source '{d.source}': true distance {d.true} m is not above zero")
    kept = [d for d in distances if np.isfinite(d.measured).any()]
    if not kept:
        raise InputError(f"none of {len(distances)} distances has a reading")
    median = np.array([np.nanmedian(d.measured) for d in kept])
    true = np.array([d.true for d in kept])
    scatter = np.array([_scatter(d.measured) for d in kept])
    names = list(dict.fromkeys(d.source for d in kept))
    index = np.array([names.index(d.source) for d in kept])
    excess = median - true
    good = ~_failed(excess, index)
    offset = calibrate_offsets(median[good], true[good], index[good], len(names)).offset
    offsets = {
        name: SourceOffset(float(offset[i]), _sigma(excess[good & (index == i)]))
        for i, name in enumerate(names)
    }
    return SourceOffsets(offsets, tuple(kept), excess, _left_out(excess, index), scatter, ~good)


def _left_out(
    excess: Float[np.ndarray, "n"], index: Int[np.ndarray, "n"]
) -> Float[np.ndarray, "n"]:
    """Excess less the offset that all other distances give, found without any word of this one."""
    out = np.full(len(excess), np.nan)
    for i in range(len(excess)):
        rest = np.arange(len(excess)) != i
        good = ~_failed(excess[rest], index[rest]) & (index[rest] == index[i])
        if good.any():
            out[i] = excess[i] - excess[rest][good].mean()
    return out


def _failed(excess: Float[np.ndarray, "n"], index: Int[np.ndarray, "n"]) -> Bool[np.ndarray, "n"]:
    """Distances far from the median of their source, by the deviation of all sources' distances.

    A source of fewer than three, or most of whose distances would fail, is left as it is; so are
    all where there are too few distances to tell how they scatter.
    """
    middle = np.array([np.median(excess[index == i]) for i in index])
    away = np.abs(excess - middle)
    counted = np.bincount(index)[index] > 2
    if counted.sum() - len(np.unique(index[counted])) < _ENOUGH:
        return np.zeros(len(excess), bool)
    deviation = _SIGMA_OF_MAD * np.median(away[counted])
    failed = counted & (away > max(_FAILED * deviation, _NEVER_FAILED))
    share = np.array([failed[index == i].mean() for i in index])
    return failed & (share < 0.5)


def pair_readings(
    recording: Recording, source: str, receiver: str, interval: tuple[float, float] | None = None
) -> Float[np.ndarray, "n"]:
    """Distances that a recording has of one pair, as they were read before any calibration [m].

    Args:
        recording: nothing moves in it, or not in the interval.
        source: site of the source; its prefix `source/` may be left out.
        receiver: sensor or anchor.
        interval: first and last time [s]; default all.

    Raises:
        InputError: the recording has no distances, or none of that source or receiver.
    """
    ranges = uncalibrated(recording).ranges
    if ranges is None:
        raise InputError("the recording has no distances (topic /range)")
    i = _index(ranges, "source", source)
    j = _index(ranges, "receiver", receiver)
    kept = (np.asarray(ranges.source) == i) & (np.asarray(ranges.receiver) == j)
    time = np.asarray(ranges.time)
    if interval is not None:
        kept &= (time >= interval[0]) & (time <= interval[1])
    kept &= np.asarray(ranges.confidence) > 0
    return np.asarray(ranges.distance)[kept]


def _index(ranges: RangeStream, what: str, name: str) -> int:
    names: tuple[str, ...] = getattr(ranges, f"{what}_names")
    for candidate in (name, f"{what}/{name}"):
        if candidate in names:
            return names.index(candidate)
    raise unknown_name(what, name, names)


def _scatter(readings: np.ndarray) -> float:
    known = readings[np.isfinite(readings)]
    return float(_SIGMA_OF_MAD * np.median(np.abs(known - np.median(known))))


def _sigma(excess: np.ndarray) -> float:
    """Standard deviation of a mean; 0 (not known) of a single value."""
    return float(excess.std(ddof=1) / np.sqrt(len(excess))) if len(excess) > 1 else 0.0
