"""Recordings: measured streams, the declared set-up, and the truth of simulated ones."""

from mocap_jax.recording.cut import CUT_START, CUT_STOP, cut
from mocap_jax.recording.driver_box import DriverBox
from mocap_jax.recording.ragged_ends import ragged_ends
from mocap_jax.recording.recording import Recording, Truth
from mocap_jax.recording.setup import NoiseFigures, RestHold, SensorSpec, Setup
from mocap_jax.recording.streams import (
    InertialStream,
    MagneticStream,
    RangeStream,
    RootStream,
    TemperatureStream,
)

__all__ = [
    "CUT_START", "CUT_STOP", "DriverBox", "InertialStream", "MagneticStream", "NoiseFigures",
    "RangeStream", "Recording", "RestHold", "RootStream", "SensorSpec", "Setup",
    "TemperatureStream", "Truth", "cut", "ragged_ends",
]  # fmt: skip
