"""Recordings of other systems: a file a format, each returns a `Source`; `build` makes it ours."""

from mocap_jax.io.convert.build import left_out, recording_of, worn_sensors
from mocap_jax.io.convert.columns import is_column_mapping, presets, read_column_mapping
from mocap_jax.io.convert.convention import (
    ACCELERATIONS,
    ACCELEROMETER_UNITS,
    GYROSCOPE_UNITS,
    MAGNETOMETER_UNITS,
    QUATERNION_DIRECTIONS,
    QUATERNION_ORDERS,
    WORLD_UPS,
    Convention,
    Overrides,
)
from mocap_jax.io.convert.formats import FORMATS, read_source
from mocap_jax.io.convert.mapping import Mapping, Worn, read_mapping
from mocap_jax.io.convert.source import ReadOptions, SegmentPoses, SensorSamples, Source

__all__ = [
    "ACCELERATIONS", "ACCELEROMETER_UNITS", "Convention", "FORMATS", "GYROSCOPE_UNITS",
    "MAGNETOMETER_UNITS", "Mapping", "Overrides", "QUATERNION_DIRECTIONS", "QUATERNION_ORDERS",
    "ReadOptions", "SegmentPoses", "SensorSamples", "Source", "WORLD_UPS", "Worn",
    "is_column_mapping", "left_out", "presets", "read_column_mapping", "read_mapping",
    "read_source", "recording_of", "worn_sensors",
]  # fmt: skip
