"""Our own protobuf messages, built at run time: no compiler, no generated code.

`mocap_jax.Range` is one ultrasonic distance, `mocap_jax.Covariance` the covariance of one pose,
`mocap_jax.PairCovariance` that of a pose with the one before, `mocap_jax.Waveform` a piece of a
wire's samples and `mocap_jax.Pulse` an ultrasonic emission.
Their definitions travel inside every file, as MCAP demands.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2

from mocap_jax.errors import InputError

_FIELD = descriptor_pb2.FieldDescriptorProto
_TIMESTAMP = ".google.protobuf.Timestamp"
_SECOND = 1_000_000_000

_MESSAGES = {
    "Range": (
        ("stamp", _TIMESTAMP),  # Of the emission.
        ("source", _FIELD.TYPE_STRING),
        ("receiver", _FIELD.TYPE_STRING),
        ("distance_m", _FIELD.TYPE_DOUBLE),
        ("confidence", _FIELD.TYPE_DOUBLE),
    ),
    "Waveform": (
        ("stamp", _TIMESTAMP),  # Of the first sample.
        ("sample_rate_hz", _FIELD.TYPE_DOUBLE),
        ("samples", _FIELD.TYPE_BYTES),  # int16, little-endian.
    ),
    "Pulse": (
        ("stamp", _TIMESTAMP),  # Of the emission.
        ("source", _FIELD.TYPE_STRING),
    ),
    "Covariance": (
        ("stamp", _TIMESTAMP),
        ("dimension", _FIELD.TYPE_UINT32),
        ("upper", (_FIELD.TYPE_DOUBLE,)),  # Upper triangle, row by row.
    ),
    "PairCovariance": (
        ("stamp", _TIMESTAMP),  # Of the earlier pose.
        ("next_stamp", _TIMESTAMP),  # Of the later pose.
        ("dimension", _FIELD.TYPE_UINT32),
        ("values", (_FIELD.TYPE_DOUBLE,)),  # Row by row; rows: later, columns: earlier pose.
    ),
}


def _build() -> dict[str, Any]:
    file = descriptor_pb2.FileDescriptorProto(
        name="mocap_jax.proto", package="mocap_jax", syntax="proto3"
    )
    file.dependency.append(timestamp_pb2.DESCRIPTOR.name)
    for name, fields in _MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, (field_name, kind) in enumerate(fields, start=1):
            field = message.field.add(name=field_name, number=number, label=_FIELD.LABEL_OPTIONAL)
            if isinstance(kind, str):
                field.type, field.type_name = _FIELD.TYPE_MESSAGE, kind
            elif isinstance(kind, tuple):
                field.type, field.label = kind[0], _FIELD.LABEL_REPEATED
            else:
                field.type = kind
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.Add(file)
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"mocap_jax.{name}"))
        for name in _MESSAGES
    }


_CLASSES = _build()
Range = _CLASSES["Range"]
Waveform = _CLASSES["Waveform"]
Pulse = _CLASSES["Pulse"]
Covariance = _CLASSES["Covariance"]
PairCovariance = _CLASSES["PairCovariance"]

__all__ = [
    "Covariance", "FrameTransforms", "PairCovariance", "PoseInFrame", "Pulse", "Range", "Waveform",
    "decode_covariances", "decode_pair_covariances", "decode_poses", "decode_ranges",
    "encode_covariances", "encode_pair_covariances", "encode_poses", "encode_ranges",
    "decode_pulse", "decode_waveform", "encode_pulse", "encode_transforms", "encode_waveform",
]  # fmt: skip


def _set_stamp(stamp: timestamp_pb2.Timestamp, nanoseconds: int) -> None:
    stamp.seconds, stamp.nanos = divmod(nanoseconds, _SECOND)


def _nanoseconds(stamp: timestamp_pb2.Timestamp) -> int:
    return stamp.seconds * _SECOND + stamp.nanos


def encode_ranges(
    stamps_ns: np.ndarray,
    source: Sequence[str],
    receiver: Sequence[str],
    distance: np.ndarray,
    confidence: np.ndarray,
) -> list[bytes]:
    """Encode Range messages (distance in metres, confidence 0 to 1)."""
    message, out = Range(), []
    rows = zip(
        stamps_ns.tolist(), source, receiver, distance.tolist(), confidence.tolist(), strict=True
    )
    for stamp, message.source, message.receiver, message.distance_m, message.confidence in rows:
        _set_stamp(message.stamp, stamp)
        out.append(message.SerializeToString())
    return out


def decode_ranges(
    payloads: Iterable[bytes],
) -> tuple[np.ndarray, list[str], list[str], np.ndarray, np.ndarray]:
    """Stamps [ns], source names, receiver names, distances [m], confidences."""
    message, rows = Range(), []
    for payload in payloads:
        message.ParseFromString(payload)
        rows.append((
            _nanoseconds(message.stamp), message.source, message.receiver, message.distance_m,
            message.confidence,
        ))  # fmt: skip
    stamps, source, receiver, distance, confidence = zip(*rows, strict=True) if rows else [()] * 5
    return (
        np.array(stamps, np.int64), list(source), list(receiver),
        np.array(distance, np.float64), np.array(confidence, np.float64),
    )  # fmt: skip


def encode_waveform(stamp_ns: int, rate_hz: float, samples: np.ndarray) -> bytes:
    """One Waveform message of int16 samples."""
    message = Waveform(sample_rate_hz=rate_hz, samples=samples.astype("<i2").tobytes())
    _set_stamp(message.stamp, stamp_ns)
    return message.SerializeToString()


def decode_waveform(payload: bytes) -> tuple[int, float, np.ndarray]:
    """Stamp of the first sample [ns], rate [Hz], samples (int16)."""
    message = Waveform.FromString(payload)
    samples = np.frombuffer(message.samples, "<i2")
    return _nanoseconds(message.stamp), message.sample_rate_hz, samples


def encode_pulse(stamp_ns: int, source: str) -> bytes:
    """One Pulse message."""
    message = Pulse(source=source)
    _set_stamp(message.stamp, stamp_ns)
    return message.SerializeToString()


def decode_pulse(payload: bytes) -> tuple[int, str]:
    """Stamp of the emission [ns], site name of the source."""
    message = Pulse.FromString(payload)
    return _nanoseconds(message.stamp), message.source


def encode_poses(
    frame_id: str, stamps_ns: np.ndarray, position: np.ndarray, orientation: np.ndarray
) -> list[bytes]:
    """Encode foxglove.PoseInFrame messages: position (n, 3) [m], orientation (n, 4) wxyz."""
    message, out = PoseInFrame(frame_id=frame_id), []
    p, r = message.pose.position, message.pose.orientation
    rows = zip(stamps_ns.tolist(), position.tolist(), orientation.tolist(), strict=True)
    for stamp, (p.x, p.y, p.z), (r.w, r.x, r.y, r.z) in rows:
        _set_stamp(message.timestamp, stamp)
        out.append(message.SerializeToString())
    return out


def decode_poses(payloads: Sequence[bytes]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps [ns], positions [m] (n, 3), orientations wxyz (n, 4)."""
    n = len(payloads)
    stamps, position, orientation = np.zeros(n, np.int64), np.zeros((n, 3)), np.zeros((n, 4))
    message = PoseInFrame()
    for i, payload in enumerate(payloads):
        message.ParseFromString(payload)
        p, r = message.pose.position, message.pose.orientation
        stamps[i] = _nanoseconds(message.timestamp)
        position[i], orientation[i] = (p.x, p.y, p.z), (r.w, r.x, r.y, r.z)
    return stamps, position, orientation


def encode_transforms(
    frames: Sequence[tuple[str, str]],
    stamps_ns: np.ndarray,
    translation: np.ndarray,
    rotation: np.ndarray,
) -> list[bytes]:
    """Encode foxglove.FrameTransforms messages.

    Args:
        frames: names (parent, child) of k frames.
        stamps_ns: stamps [ns], shape (n,).
        translation: child's origin in the parent [m], shape (n, k, 3).
        rotation: child to parent, wxyz, shape (n, k, 4).
    """
    message, out = FrameTransforms(), []
    transforms = [
        message.transforms.add(parent_frame_id=parent, child_frame_id=child)
        for parent, child in frames
    ]
    rows = zip(stamps_ns.tolist(), translation.tolist(), rotation.tolist(), strict=True)
    for stamp, positions, quaternions in rows:
        for one, position, quaternion in zip(transforms, positions, quaternions, strict=True):
            t, r = one.translation, one.rotation
            t.x, t.y, t.z = position
            r.w, r.x, r.y, r.z = quaternion
            _set_stamp(one.timestamp, stamp)
        out.append(message.SerializeToString())
    return out


def encode_covariances(stamps_ns: np.ndarray, covariance: np.ndarray) -> list[bytes]:
    """Encode Covariance messages, covariance (n, d, d) symmetric."""
    d = covariance.shape[1]
    upper = covariance[:, *np.triu_indices(d)]
    out = []
    for stamp, values in zip(stamps_ns.tolist(), upper, strict=True):
        message = Covariance(dimension=d, upper=values.tolist())
        _set_stamp(message.stamp, stamp)
        out.append(message.SerializeToString())
    return out


def decode_covariances(payloads: Sequence[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [ns] and covariances (n, d, d)."""
    stamps, uppers, d = [], [], None
    for payload in payloads:
        message = Covariance.FromString(payload)
        if d not in (None, message.dimension):
            raise InputError("covariances of different dimensions in one topic")
        d = message.dimension
        stamps.append(_nanoseconds(message.stamp))
        uppers.append(np.array(message.upper, np.float64))
    d = d or 0
    out = np.zeros((len(uppers), d, d))
    rows, columns = np.triu_indices(d)
    if uppers:
        out[:, rows, columns] = np.stack(uppers)
        out[:, columns, rows] = out[:, rows, columns]
    return np.array(stamps, np.int64), out


def encode_pair_covariances(stamps_ns: np.ndarray, pairs: np.ndarray) -> list[bytes]:
    """Encode PairCovariance messages of n + 1 stamps, pairs (n, d, d): later, earlier pose."""
    out, times = [], stamps_ns.tolist()
    for before, after, values in zip(times[:-1], times[1:], pairs, strict=True):
        message = PairCovariance(dimension=len(values), values=values.ravel().tolist())
        _set_stamp(message.stamp, before)
        _set_stamp(message.next_stamp, after)
        out.append(message.SerializeToString())
    return out


def decode_pair_covariances(
    payloads: Sequence[bytes],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps of the earlier and of the later pose [ns], covariances (n, d, d)."""
    messages = [PairCovariance.FromString(p) for p in payloads]
    if len({m.dimension for m in messages}) > 1:
        raise InputError("covariances of different dimensions in one topic")
    d = messages[0].dimension if messages else 0
    before = np.array([_nanoseconds(m.stamp) for m in messages], np.int64)
    after = np.array([_nanoseconds(m.next_stamp) for m in messages], np.int64)
    return before, after, np.array([m.values for m in messages], np.float64).reshape(-1, d, d)
