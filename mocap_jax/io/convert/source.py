"""What every reader returns: the samples of a file as they stand, and what they mean."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from mocap_jax.io.convert.convention import Convention


@dataclass(frozen=True)
class ReadOptions:
    """What a reader may be told."""

    rate_hz: float | None = None
    """Sampling rate, where the file does not say [Hz]."""
    mapping: str | None = None
    """Mapping file, or the name of a preset (readers of columns need it)."""
    trial: str | None = None
    """Which trial of a folder that holds several."""
    progress: bool = False
    """Show a progress bar on stderr."""


@dataclass(frozen=True)
class SensorSamples:
    """One sensor's samples in the file's own units and frames; None where it has no such kind."""

    identity: str
    """What the file calls the sensor: serial number, label, folder."""
    time: Float[np.ndarray, "n"]
    """On one clock for all sensors [s]."""
    rate_hz: float
    """Nominal sampling rate [Hz]."""
    accelerometer: Float[np.ndarray, "n 3"] | None = None
    gyroscope: Float[np.ndarray, "n 3"] | None = None
    orientation: Float[np.ndarray, "n 4"] | None = None
    magnetic_time: Float[np.ndarray, "m"] | None = None
    """Of the magnetic samples [s]; None: the same as `time`."""
    magnetic: Float[np.ndarray, "m 3"] | None = None
    segment: str | None = None
    """Segment that the file itself names, as it calls it."""


@dataclass(frozen=True)
class RootSamples:
    """An externally measured pose of the root segment, in the file's world frame."""

    time: Float[np.ndarray, "n"]
    position: Float[np.ndarray, "n 3"]
    """[m]"""
    orientation: Float[np.ndarray, "n 4"]
    truth: bool = False
    """A reference to compare with, of the only sensor's pose; no measurement to estimate from."""


@dataclass(frozen=True)
class SegmentPoses:
    """Poses of body segments that the other system reconstructed."""

    names: tuple[str, ...]
    time: Float[np.ndarray, "n"]
    orientation: Float[np.ndarray, "n s 4"]
    """R_world_segment (wxyz)."""
    position: Float[np.ndarray, "n s 3"]
    """Origins in the world [m]."""
    offsets: Float[np.ndarray, "s 3"] | None = None
    """Origin of each segment when all segments are aligned with the world [m]."""


@dataclass(frozen=True)
class Source:
    """One recording of another system."""

    format: str
    name: str
    """File or folder, for messages."""
    sensors: tuple[SensorSamples, ...]
    convention: Convention
    facts: dict[str, str | float | int | bool] = field(default_factory=dict)
    """Rate, clock, device, ...: goes to the provenance."""
    salvage: tuple[str, ...] = ()
    """What was lost, one sentence each."""
    remarks: tuple[str, ...] = ()
    """What was left out although it was there, one sentence each."""
    root: RootSamples | None = None
    poses: SegmentPoses | None = None
    start_utc_ns: int | None = None
    """Absolute time of the clock's zero; None where it is not known."""
    subject: str = ""
