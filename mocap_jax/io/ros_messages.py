"""ROS 2 messages of our topics: their definitions, and streams of them as arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from mocap_jax.io import cdr

IMU = "sensor_msgs/msg/Imu"
MAGNETIC_FIELD = "sensor_msgs/msg/MagneticField"
TEMPERATURE = "sensor_msgs/msg/Temperature"
JOINT_STATE = "sensor_msgs/msg/JointState"

_LINE = "=" * 80
_HEADER = f"""
{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_VECTOR = f"""{_LINE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
_QUATERNION = f"""{_LINE}
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""
ROS_SCHEMAS = {
    IMU: """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance"""
    + _HEADER + _QUATERNION + _VECTOR,
    MAGNETIC_FIELD: """std_msgs/Header header
geometry_msgs/Vector3 magnetic_field
float64[9] magnetic_field_covariance"""
    + _HEADER + _VECTOR,
    TEMPERATURE: """std_msgs/Header header
float64 temperature
float64 variance"""
    + _HEADER,
    JOINT_STATE: """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort"""
    + _HEADER,
}  # fmt: skip

_ABSENT = -1.0
"""First element of a covariance whose quantity was not measured (ROS convention)."""


def encode_imu(
    frame_id: str,
    stamps_ns: np.ndarray,
    orientation: np.ndarray,
    gyroscope: np.ndarray,
    accelerometer: np.ndarray,
    sigmas: tuple[float, float, float],
) -> list[bytes]:
    """Encode Imu messages; samples that are NaN throughout get covariance[0] = -1.

    Args:
        frame_id: sensor name.
        stamps_ns: stamps [ns], shape (n,).
        orientation: sensor to world, wxyz (n, 4). The identity is written where none is known.
        gyroscope: [rad/s] (n, 3).
        accelerometer: [m/s^2] (n, 3).
        sigmas: their standard deviations [rad, rad/s, m/s^2], same order.
    """
    absent = np.isnan(orientation).all(axis=1)
    xyzw = np.where(absent[:, None], [0.0, 0.0, 0.0, 1.0], np.roll(orientation, -1, axis=1))
    blocks = [
        xyzw, _covariances(orientation, sigmas[0]),
        gyroscope, _covariances(gyroscope, sigmas[1]),
        accelerometer, _covariances(accelerometer, sigmas[2]),
    ]  # fmt: skip
    return cdr.encode(cdr.start_body(frame_id), stamps_ns, np.concatenate(blocks, axis=1))


def decode_imu(
    payloads: Sequence[bytes], schema: Schema
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Stamps [ns], orientation (wxyz), gyroscope [rad/s] and accelerometer [m/s^2].

    Quantities whose covariance starts with -1 become NaN.
    """
    stamps, x = _decode(payloads, schema, 37, _imu_fields)
    orientation = np.where(x[:, 4:5] == _ABSENT, np.nan, np.roll(x[:, :4], 1, axis=1))
    gyroscope = np.where(x[:, 16:17] == _ABSENT, np.nan, x[:, 13:16])
    accelerometer = np.where(x[:, 28:29] == _ABSENT, np.nan, x[:, 25:28])
    return stamps, orientation, gyroscope, accelerometer


def encode_magnetic(
    frame_id: str, stamps_ns: np.ndarray, field: np.ndarray, sigma: float
) -> list[bytes]:
    """Encode MagneticField messages, field (n, 3) in tesla."""
    blocks = [field, _covariances(field, sigma)]
    return cdr.encode(cdr.start_body(frame_id), stamps_ns, np.concatenate(blocks, axis=1))


def decode_magnetic(payloads: Sequence[bytes], schema: Schema) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [ns] and field [T] (n, 3)."""
    fields = lambda m: [*_xyz(m.magnetic_field), *m.magnetic_field_covariance]  # noqa: E731
    stamps, x = _decode(payloads, schema, 12, fields)
    return stamps, np.where(x[:, 3:4] == _ABSENT, np.nan, x[:, :3])


def encode_temperature(stamps_ns: np.ndarray, celsius: np.ndarray) -> list[bytes]:
    """Encode Temperature messages (variance 0: unknown)."""
    values = np.stack([celsius, np.zeros_like(celsius)], axis=1)
    return cdr.encode(cdr.start_body(""), stamps_ns, values)


def decode_temperature(payloads: Sequence[bytes], schema: Schema) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [ns] and temperature [degrees Celsius]."""
    stamps, x = _decode(payloads, schema, 2, lambda m: [m.temperature, m.variance])
    return stamps, x[:, 0]


def encode_joint_states(
    names: Sequence[str], stamps_ns: np.ndarray, values: np.ndarray, *, velocity: bool = False
) -> list[bytes]:
    """Encode JointState messages with either positions or velocities, values (n, len(names))."""
    body = _joint_head(names)
    empty = (0).to_bytes(4, "little")
    if velocity:
        cdr.put_count(body, 0)
    cdr.put_count(body, len(names))
    return cdr.encode(body, stamps_ns, values, empty if velocity else empty * 2)


def decode_joint_states(
    payloads: Sequence[bytes], schema: Schema, *, velocity: bool = False
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Names, stamps [ns] and values (n, len(names)) of positions or velocities."""
    quantity = "velocity" if velocity else "position"
    decoder = DecoderFactory().decoder_for("cdr", schema)
    names = tuple(decoder(payloads[0]).name)  # type: ignore[misc]
    # What follows the frame id: its length depends on the names alone.
    body = _joint_head(names)
    if velocity:
        cdr.put_count(body, 0)
    cdr.put_count(body, len(names))
    skip = len(body) - len(cdr.start_body(""))

    def fields(message: Any) -> list[float]:
        if tuple(message.name) != names:
            raise ValueError("the joint names change within a topic")
        return list(getattr(message, quantity))

    # The shortcut holds for messages of our own layout: frame id empty, one quantity.
    uniform = payloads[0][12 : 12 + len(body) - 8] == bytes(body[8:])
    stamps, x = _decode(payloads, schema, len(names), fields, skip if uniform else None)
    return names, stamps, x


def _joint_head(names: Sequence[str]) -> bytearray:
    body = cdr.start_body("")
    cdr.put_count(body, len(names))
    for name in names:
        cdr.put_string(body, name)
    return body


def _covariances(values: np.ndarray, sigma: float) -> np.ndarray:
    """Diagonal covariances (n, 9), -1 first where nothing was measured."""
    out = np.tile(np.diag([sigma**2] * 3).ravel(), (len(values), 1))
    out[np.isnan(values).all(axis=1)] = [_ABSENT] + [0.0] * 8
    return out


def _xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


def _imu_fields(message: Any) -> list[float]:
    return [
        *_xyz(message.orientation), message.orientation.w, *message.orientation_covariance,
        *_xyz(message.angular_velocity), *message.angular_velocity_covariance,
        *_xyz(message.linear_acceleration), *message.linear_acceleration_covariance,
    ]  # fmt: skip


def _decode(
    payloads: Sequence[bytes],
    schema: Schema,
    k: int,
    fields: Callable[[Any], list[float]],
    skip: int | None = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and values: as one array where the messages allow it, else one by one."""
    if not payloads:
        return np.zeros(0, np.int64), np.zeros((0, k))
    if skip is not None and (fast := cdr.decode(payloads, skip, k)) is not None:
        return fast
    decoder = DecoderFactory().decoder_for("cdr", schema)
    if decoder is None:
        raise ValueError(f"messages of schema '{schema.name}' ({schema.encoding}) are not ROS 2")
    messages = [decoder(p) for p in payloads]
    stamps = [m.header.stamp.sec * 1_000_000_000 + m.header.stamp.nanosec for m in messages]
    values = np.array([fields(m) for m in messages], np.float64).reshape(len(messages), -1)
    if values.shape[1] != k:
        raise ValueError(f"messages hold {values.shape[1]} numbers instead of {k}")
    return np.array(stamps, np.int64), values
