"""Recordings from MCAP files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from jax import Array, device_put
from mcap.records import Schema

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io import ros_messages as ros
from mocap_jax.io.array_archive import unpack_arrays
from mocap_jax.io.mcap_read import DAMAGE, Contents, read_contents
from mocap_jax.io.mcap_trajectory import file_start, read_trajectory
from mocap_jax.io.mcap_write import ATTACHMENTS, FORMAT_VERSION, METADATA_NAME
from mocap_jax.io.setup_toml import setup_from_toml
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
    calibrated,
    without_lost_rest,
)

_TOPICS = "/inertial/<sensor>, /magnetic/<sensor>, /range, /root, /temperature, /truth/..."
_Stream = TypeVar("_Stream", InertialStream, MagneticStream)
_Any = TypeVar("_Any")


def read_recording(path: str | os.PathLike[str]) -> Recording:
    """Read a recording from an MCAP file.

    A truncated or damaged file gives what is sound; `Recording.salvage` then says what was lost.
    Measurements are not checked here: see `validate_recording`. A calibration in the set-up that
    has not been applied is (`recording.uncalibrated` gives what the sensors read).

    Args:
        path: MCAP file with the topics of the documentation; attachments may be absent.

    Raises:
        InputError: not an MCAP file, not a recording, written by a newer format version, or
            nothing can be read from it.
    """
    return calibrated(recording_from(path, read_contents(path)))


def recording_from(path: str | os.PathLike[str], contents: Contents) -> Recording:
    """Make the recording of a file's contents, as the sensors read (see `read_recording`)."""
    _refuse_foreign(path, contents)
    return _Reader(path, contents).recording()


def _refuse_foreign(path: str | os.PathLike[str], contents: Contents) -> None:
    facts = contents.metadata.get(METADATA_NAME, {})
    version = facts.get("format_version", str(FORMAT_VERSION))
    if version.isdigit() and int(version) > FORMAT_VERSION:
        raise InputError(
            f"{path}: written in format version {version}; this software reads up to "
            f"{FORMAT_VERSION} (update mocap_jax)"
        )
    if kind_of(contents) == "solution":
        raise InputError(f"{path}: this is a solution, not a recording")
    if kind_of(contents) == "raw":
        raise InputError(
            f"{path}: this is a raw recording of a driver box; make a recording of it first: "
            f"mocap-jax decode {path} -o REC.mcap"
        )
    known = (INERTIAL, MAGNETIC, RANGE, ROOT, TEMPERATURE, TRUTH)
    if METADATA_NAME not in contents.metadata and not any(
        topic.startswith(known) for topic in contents.channels
    ):
        found = ", ".join(list(contents.channels)[:8]) or "none"
        raise InputError(f"{path}: no topics of a recording (expected {_TOPICS}; found {found})")


def kind_of(contents: Contents) -> str:
    """Whether a file is a "recording" or a "solution"."""
    declared = contents.metadata.get(METADATA_NAME, {}).get("kind")
    if declared:
        return declared
    solved = any(topic.startswith("/solution/") for topic in contents.channels)
    return "solution" if solved else "recording"


class _Reader:
    """Streams of one file; those that do not decode are left out and noted."""

    def __init__(self, path: str | os.PathLike[str], contents: Contents) -> None:
        self._path = path
        self._contents = contents
        self._start = file_start(contents)
        self._lost: list[str] = []

    def recording(self) -> Recording:
        recording = Recording(
            inertial=self._all(INERTIAL, self._inertial),
            ranges=self._one(RANGE, self._ranges),
            root=self._one(ROOT, self._root),
            magnetic=self._all(MAGNETIC, self._magnetic),
            temperature=self._one(TEMPERATURE, self._temperature),
            truth=self._truth(),
            setup=self._setup(),
            body_xml=self._text("body.xml"),
            start_utc_ns=self._start,
            subject=self._contents.metadata.get(METADATA_NAME, {}).get("subject", ""),
        )
        if recording.body_xml is None and self._contents.damage and self._had("body.xml"):
            self._lost.append("the body model (attachment body.xml) is lost")
        salvage = self._contents.damage + tuple(self._lost)
        if salvage:
            recording, told = without_lost_rest(recording)
            salvage += (told,) if told else ()
        return replace(recording, salvage=salvage)

    def _had(self, attachment: str) -> bool:
        """Whether the file had an attachment; files that do not list them may have had it."""
        listed = self._contents.metadata.get(METADATA_NAME, {}).get(ATTACHMENTS)
        return listed is None or attachment in json.loads(listed)

    def _all(self, prefix: str, read: Callable[[str], _Stream]) -> dict[str, _Stream]:
        found = {name: self._one(topic, read) for name, topic in
                 self._contents.topics(prefix).items()}  # fmt: skip
        kept = {name: stream for name, stream in found.items() if stream is not None}
        if self._contents.damage:
            for name in [n for n, stream in kept.items() if not len(stream.time)]:
                self._lost.append(f"topic {prefix}{name}: all samples are lost")
                del kept[name]
        return kept

    def _one(self, topic: str, read: Callable[[str], _Any]) -> _Any | None:
        if topic not in self._contents.channels:
            return None
        try:
            return read(topic)
        except DAMAGE as error:
            self._lost.append(f"topic {topic} cannot be decoded ({' '.join(str(error).split())})")
            return None

    def _time(self, stamps: np.ndarray) -> Array:
        return device_put((stamps - self._start) / 1e9)

    def _messages(self, topic: str) -> tuple[Sequence[bytes], Schema]:
        return self._contents.payloads[topic], self._contents.schema(topic)

    def _inertial(self, topic: str) -> InertialStream:
        stamps, orientation, gyroscope, accelerometer = ros.decode_imu(*self._messages(topic))
        return InertialStream(
            self._time(stamps), device_put(accelerometer), device_put(gyroscope),
            device_put(orientation),
        )  # fmt: skip

    def _magnetic(self, topic: str) -> MagneticStream:
        stamps, field = ros.decode_magnetic(*self._messages(topic))
        return MagneticStream(self._time(stamps), device_put(field))

    def _temperature(self, topic: str) -> TemperatureStream:
        stamps, celsius = ros.decode_temperature(*self._messages(topic))
        return TemperatureStream(self._time(stamps), device_put(celsius))

    def _root(self, topic: str) -> RootStream:
        stamps, position, orientation = pb.decode_poses(self._contents.payloads[topic])
        return RootStream(self._time(stamps), device_put(position), device_put(orientation))

    def _ranges(self, topic: str) -> RangeStream:
        stamps, source, receiver, distance, confidence = pb.decode_ranges(
            self._contents.payloads[topic]
        )
        declared = self._contents.channels[topic].metadata
        sources = _names(declared.get("sources"), source)
        receivers = _names(declared.get("receivers"), receiver)
        return RangeStream(
            self._time(stamps), _indices(source, sources), _indices(receiver, receivers),
            device_put(distance), device_put(confidence), sources, receivers,
        )  # fmt: skip

    def _truth(self) -> Truth | None:
        if not self._contents.topics(TRUTH + "/"):
            return None
        xml = self._text(TRUE_BODY)
        if xml is None:
            self._lost.append(f"the truth is lost: no sound attachment {TRUE_BODY}")
            return None
        try:
            trajectory = read_trajectory(self._contents, TRUTH, load_body(xml).topology)
        except (InputError, *DAMAGE) as error:
            self._lost.append(f"the truth is lost: {error}")
            return None
        return Truth(trajectory, xml, self._true_parameters())

    def _true_parameters(self) -> dict[str, Array]:
        raw = self._contents.attachments.get(TRUE_PARAMETERS)
        if raw is None:
            return {}
        try:
            return {name: device_put(value) for name, value in unpack_arrays(raw).items()}
        except DAMAGE as error:
            self._lost.append(f"the true parameters are lost: {error}")
            return {}

    def _setup(self) -> Setup:
        text = self._text("setup.toml")
        if text is not None:
            return setup_from_toml(text, f"{self._path}: setup.toml")
        if self._contents.damage:
            self._lost.append("the set-up (attachment setup.toml) is lost: defaults are used")
        return Setup()

    def _text(self, attachment: str) -> str | None:
        raw = self._contents.attachments.get(attachment)
        if raw is None:
            return None
        try:
            return raw.decode()
        except UnicodeDecodeError:
            self._lost.append(f"attachment {attachment} is not text")
            return None


def _names(declared: str | None, found: list[str]) -> tuple[str, ...]:
    """Names as the channel declares them, then any others in order of appearance."""
    names = json.loads(declared) if declared else []
    return tuple(dict.fromkeys([*names, *found]))


def _indices(found: list[str], names: tuple[str, ...]) -> Array:
    index = {name: i for i, name in enumerate(names)}
    return device_put(np.array([index[name] for name in found], np.int64))
