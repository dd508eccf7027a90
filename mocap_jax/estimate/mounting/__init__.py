"""Sensor-to-segment calibration and heading, with a report of what was found and how sure it is."""

from mocap_jax.estimate.mounting.calibrate import calibrate_mounting
from mocap_jax.estimate.mounting.result import MountingCalibration, SensorMounting

__all__ = ["MountingCalibration", "SensorMounting", "calibrate_mounting"]
