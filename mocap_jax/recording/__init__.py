"""Recordings: measured streams, the declared set-up, and the truth of simulated ones."""

from mocap_jax.recording.calibrated import calibrated, uncalibrated, with_calibration
from mocap_jax.recording.calibration import (
    AxisCalibration,
    AxisNoise,
    Calibration,
    SourceOffset,
)
from mocap_jax.recording.cut import CUT_START, CUT_STOP, cut
from mocap_jax.recording.driver_box import DriverBox
from mocap_jax.recording.extent import Extent, frame_extent
from mocap_jax.recording.lost_rest import in_gap, without_lost_rest
from mocap_jax.recording.ragged_ends import ragged_ends
from mocap_jax.recording.recording import Recording, Truth
from mocap_jax.recording.root_speed import doubtful_root, root_speed
from mocap_jax.recording.setup import NoiseFigures, RestHold, SensorSpec, Setup
from mocap_jax.recording.streams import (
    InertialStream,
    MagneticStream,
    RangeStream,
    RootStream,
    TemperatureStream,
)
from mocap_jax.recording.unlisted import unlisted_boards

__all__ = [
    "CUT_START", "CUT_STOP", "AxisCalibration", "AxisNoise", "Calibration", "DriverBox",
    "Extent",
    "InertialStream", "MagneticStream", "NoiseFigures", "RangeStream", "Recording", "RestHold",
    "RootStream", "SensorSpec", "Setup", "SourceOffset", "TemperatureStream", "Truth",
    "calibrated", "cut", "frame_extent", "doubtful_root", "in_gap", "ragged_ends", "root_speed",
    "uncalibrated", "unlisted_boards", "with_calibration", "without_lost_rest",
]  # fmt: skip
