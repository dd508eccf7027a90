"""Measured streams: each has its own clock and rate; missing values are NaN.

All times are float64 seconds since the recording's start.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import jax
from jaxtyping import Float, Int

ArrayLike = jax.Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class InertialStream:
    """One board's samples. A sample is the mean over its interval, stamped at the centre."""

    time: Float[ArrayLike, "n"]
    accelerometer: Float[ArrayLike, "n 3"]
    """Specific force in the sensor frame, gravity included [m/s^2]; +9.81 along up at rest."""
    gyroscope: Float[ArrayLike, "n 3"]
    """Angular velocity of the sensor in the sensor frame [rad/s]."""
    orientation: Float[ArrayLike, "n 4"]
    """Measured sensor-to-world orientation (wxyz); NaN where none was measured."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MagneticStream:
    """Magnetic field in the sensor frame [T]."""

    time: Float[ArrayLike, "n"]
    field: Float[ArrayLike, "n 3"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RangeStream:
    """Ultrasonic distances of all source-receiver pairs, in order of emission."""

    time: Float[ArrayLike, "n"]
    """Time of emission [s]."""
    source: Int[ArrayLike, "n"]
    """Index into `source_names`."""
    receiver: Int[ArrayLike, "n"]
    """Index into `receiver_names`."""
    distance: Float[ArrayLike, "n"]
    """From the source at emission to the receiver at arrival [m]."""
    confidence: Float[ArrayLike, "n"]
    """w_s w_t of Vlasic 2007 section 4.1, 0 (useless) to 1."""
    source_names: tuple[str, ...] = dataclasses.field(metadata={"static": True})
    """Site names of the sources, e.g. `source/chest_left`."""
    receiver_names: tuple[str, ...] = dataclasses.field(metadata={"static": True})
    """Sensor names (or `anchor/...` sites) of the receivers."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RootStream:
    """Externally measured pose of the root body in the world."""

    time: Float[ArrayLike, "n"]
    position: Float[ArrayLike, "n 3"]
    """[m]"""
    orientation: Float[ArrayLike, "n 4"]
    """Root-to-world (wxyz)."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TemperatureStream:
    """Air temperature [degrees Celsius]."""

    time: Float[ArrayLike, "n"]
    celsius: Float[ArrayLike, "n"]
