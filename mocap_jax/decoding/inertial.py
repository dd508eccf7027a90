"""A board's frames to its inertial stream."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jax import device_put

from mocap_jax.recording import InertialStream, NoiseFigures
from mocap_jax.signals.telemetry.converter import ConverterScales, physical
from mocap_jax.signals.telemetry.levels import restore
from mocap_jax.signals.telemetry.receive import TimedFrames


@dataclass(frozen=True)
class BoardSummary:
    """How a board's telemetry fared."""

    frames: int
    """Accepted."""
    lost: int
    """Refused between the first and the last accepted one, while locked."""
    corrected_bits: int
    overloaded: int
    """Frames in which some axis moved faster than its codes can tell."""
    saturated: int
    """Frames in which some axis was at the end of its scale."""
    contradictions: int


def inertial_stream(
    stretches: list[TimedFrames], scales: ConverterScales
) -> tuple[InertialStream, BoardSummary]:
    """Stream of all accepted frames of unbroken stretches of a wire.

    Readings of a sensor with an axis overloaded, saturated or of unknown level are NaN; frames
    without any reading are left out.
    """
    times, values = [np.zeros(0)], [np.zeros((0, 6))]
    counts = np.zeros(6, np.int64)
    for timed in stretches:
        frames = timed.frames
        levels = restore(frames)
        physics, saturated = physical(levels.values, scales)
        physics[levels.overloaded | saturated] = np.nan
        times.append(timed.time[frames.accepted])
        values.append(physics)
        good = np.flatnonzero(frames.accepted)
        lost = int((~frames.accepted[good[0] : good[-1]]).sum()) if good.size else 0
        corrected = int(frames.corrected[frames.accepted].astype(np.int64).sum())
        counts += [len(good), lost, corrected, int(levels.overloaded.any(axis=1).sum()),
                   int(saturated.any(axis=1).sum()), levels.contradictions]  # fmt: skip
    time, both = np.concatenate(times), np.concatenate(values)
    rate, force = both[:, :3].copy(), both[:, 3:].copy()
    for triple in (rate, force):
        triple[~np.isfinite(triple).all(axis=1)] = np.nan
    kept = np.isfinite(rate).any(axis=1) | np.isfinite(force).any(axis=1)
    stream = InertialStream(
        device_put(time[kept]), device_put(force[kept]), device_put(rate[kept]),
        device_put(np.full((int(kept.sum()), 4), np.nan)),
    )  # fmt: skip
    return stream, BoardSummary(*(int(c) for c in counts))


def with_round_off(noise: NoiseFigures, scales: ConverterScales) -> NoiseFigures:
    """Noise figures of what comes out of the telemetry, given those of the sensors.

    Readings are rounded to 10 bits and their sums to 12: twice a level's variance of round-off.
    """
    gyroscope, accelerometer = scales.per_level[[0, 3]] / np.sqrt(6.0)
    return replace(
        noise,
        gyroscope=float(np.hypot(noise.gyroscope, gyroscope)),
        accelerometer=float(np.hypot(noise.accelerometer, accelerometer)),
    )
