"""What calibration recordings show of the sensors: offsets, zeros, slopes and noise."""

from mocap_jax.calibration.allan import AllanCurve, AllanFit, allan_deviation, fit_processes
from mocap_jax.calibration.inertial import (
    AccelerometerOptions,
    GyroscopeOptions,
    InertialCalibration,
    calibrate_accelerometer,
    calibrate_gyroscope,
)
from mocap_jax.calibration.magnitude_fit import AxisFit
from mocap_jax.calibration.noise import (
    NoiseCalibration,
    NoiseCalibrationOptions,
    SensorNoise,
    calibrate_noise,
)
from mocap_jax.calibration.offsets import (
    KnownDistance,
    SourceOffsets,
    calibrate_source_offsets,
    pair_readings,
)

__all__ = [
    "AccelerometerOptions", "AllanCurve", "AllanFit", "AxisFit", "GyroscopeOptions",
    "InertialCalibration", "KnownDistance", "NoiseCalibration", "NoiseCalibrationOptions",
    "SensorNoise", "SourceOffsets", "allan_deviation", "calibrate_accelerometer",
    "calibrate_gyroscope", "calibrate_noise", "calibrate_source_offsets", "fit_processes",
    "pair_readings",
]  # fmt: skip
