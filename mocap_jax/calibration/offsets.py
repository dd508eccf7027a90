"""Offsets of ultrasonic sources from distances that are known (Vlasic 2007, section 4.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.recording import Calibration, RangeStream, Recording, SourceOffset, uncalibrated
from mocap_jax.signals.ultrasonic.calibration import calibrate_offsets

_SIGMA_OF_MAD = 1.4826


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

    @property
    def calibration(self) -> Calibration:
        """For a set-up."""
        return Calibration(source_offset=self.offsets)


def calibrate_source_offsets(distances: Sequence[KnownDistance]) -> SourceOffsets:
    """Each source's offset: the mean excess over its distances, each the median of its readings.

    Every distance counts once, however many readings it has: what readings of one place have in
    common (echoes, how a source was held) they do not tell.

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
    out = calibrate_offsets(median, true, index, len(names))
    offsets = {
        name: SourceOffset(float(out.offset[i]), _sigma((median - true)[index == i]))
        for i, name in enumerate(names)
    }
    return SourceOffsets(offsets, tuple(kept), median - true, out.left_out_error, scatter)


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
