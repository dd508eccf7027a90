"""Recordings to MCAP files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator

import numpy as np

from mocap_jax.body import load_body
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io import ros_messages as ros
from mocap_jax.io.array_archive import pack_arrays
from mocap_jax.io.mcap_trajectory import add_trajectory
from mocap_jax.io.mcap_write import McapFile, stamps_from_seconds
from mocap_jax.io.setup_toml import setup_to_toml
from mocap_jax.io.stream_shapes import check_shapes
from mocap_jax.io.topics import (
    INERTIAL,
    MAGNETIC,
    RANGE,
    ROOT,
    TEMPERATURE,
    TRUE_BODY,
    TRUE_PARAMETERS,
    TRUTH,
)
from mocap_jax.recording import (
    InertialStream,
    MagneticStream,
    RangeStream,
    Recording,
    RootStream,
    Setup,
    TemperatureStream,
    Truth,
)

_PIECE = 4096


def write_recording(path: str | os.PathLike[str], recording: Recording) -> None:
    """Write a recording to an MCAP file, whole or not at all.

    Values keep all their digits; times are stored in whole nanoseconds since 1970 (0.5 ns of
    rounding). What cannot be done without (body, set-up) stands first, so that it survives a
    truncation.

    Args:
        path: file to write; an earlier one is replaced once the new one is complete.
        recording: what to write.

    Raises:
        InputError: the file cannot be written, a time is not finite, or an array has a wrong shape.
    """
    mcap_file(recording, "recording").write(path)


def mcap_file(recording: Recording, kind: str) -> McapFile:
    """The content of a recording's file (see `write_recording`)."""
    check_shapes(recording)
    file = McapFile(kind, recording.start_utc_ns, {"subject": recording.subject})
    if recording.body_xml is not None:
        file.attach("body.xml", "application/xml", recording.body_xml)
    file.attach("setup.toml", "application/toml", setup_to_toml(recording.setup))
    _add_truth(file, recording.truth)
    for sensor, stream in recording.inertial.items():
        _add_inertial(file, sensor, stream, recording.setup)
    for sensor, field in recording.magnetic.items():
        _add_magnetic(file, sensor, field, recording.setup)
    _add_ranges(file, recording.ranges)
    _add_root(file, recording.root)
    _add_temperature(file, recording.temperature)
    return file


def _add_inertial(file: McapFile, sensor: str, stream: InertialStream, setup: Setup) -> None:
    stamps = stamps_from_seconds(stream.time, file.start_utc_ns, INERTIAL + sensor)
    noise = setup.noise
    orientation, gyroscope, accelerometer = (
        np.asarray(x, np.float64)
        for x in (stream.orientation, stream.gyroscope, stream.accelerometer)
    )
    sigmas = (noise.orientation, noise.gyroscope, noise.accelerometer)

    def piece(rows: slice) -> list[bytes]:
        return ros.encode_imu(
            sensor, stamps[rows], orientation[rows], gyroscope[rows], accelerometer[rows], sigmas
        )

    payloads = _in_pieces(len(stamps), piece)
    file.add_topic(INERTIAL + sensor, ros.IMU, stamps, payloads)


def _in_pieces(count: int, encode: Callable[[slice], list[bytes]]) -> Iterator[bytes]:
    """Messages encoded a few thousand at a time, so that long recordings fit into memory."""
    for first in range(0, count, _PIECE):
        yield from encode(slice(first, first + _PIECE))


def _add_magnetic(file: McapFile, sensor: str, stream: MagneticStream, setup: Setup) -> None:
    stamps = stamps_from_seconds(stream.time, file.start_utc_ns, MAGNETIC + sensor)
    field = np.asarray(stream.field, np.float64)
    payloads = ros.encode_magnetic(sensor, stamps, field, setup.noise.magnetometer)
    file.add_topic(MAGNETIC + sensor, ros.MAGNETIC_FIELD, stamps, payloads)


def _add_ranges(file: McapFile, ranges: RangeStream | None) -> None:
    if ranges is None:
        return
    stamps = stamps_from_seconds(ranges.time, file.start_utc_ns, RANGE)
    source, receiver = np.asarray(ranges.source), np.asarray(ranges.receiver)
    distance = np.asarray(ranges.distance, np.float64)
    confidence = np.asarray(ranges.confidence, np.float64)

    def piece(rows: slice) -> list[bytes]:
        return pb.encode_ranges(
            stamps[rows],
            [ranges.source_names[i] for i in source[rows].tolist()],
            [ranges.receiver_names[i] for i in receiver[rows].tolist()],
            distance[rows],
            confidence[rows],
        )

    payloads = _in_pieces(len(stamps), piece)
    # Names without a single distance would be lost otherwise, and so would their order.
    names = {
        "sources": json.dumps(ranges.source_names),
        "receivers": json.dumps(ranges.receiver_names),
    }
    file.add_topic(RANGE, pb.Range, stamps, payloads, names)


def _add_root(file: McapFile, root: RootStream | None) -> None:
    if root is None:
        return
    stamps = stamps_from_seconds(root.time, file.start_utc_ns, ROOT)
    position = np.asarray(root.position, np.float64)
    payloads = pb.encode_poses("world", stamps, position, np.asarray(root.orientation, np.float64))
    file.add_topic(ROOT, pb.PoseInFrame, stamps, payloads)


def _add_temperature(file: McapFile, air: TemperatureStream | None) -> None:
    if air is None:
        return
    stamps = stamps_from_seconds(air.time, file.start_utc_ns, TEMPERATURE)
    payloads = ros.encode_temperature(stamps, np.asarray(air.celsius, np.float64))
    file.add_topic(TEMPERATURE, ros.TEMPERATURE, stamps, payloads)


def _add_truth(file: McapFile, truth: Truth | None) -> None:
    if truth is None:
        return
    file.attach(TRUE_BODY, "application/xml", truth.body_xml)
    if truth.parameters:
        packed = pack_arrays({k: np.asarray(v) for k, v in truth.parameters.items()})
        file.attach(TRUE_PARAMETERS, "application/octet-stream", packed)
    add_trajectory(file, TRUTH, load_body(truth.body_xml), truth.trajectory, "truth/")
