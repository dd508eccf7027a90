"""Recordings as MCAP files."""

from __future__ import annotations

import io
import json
import os
import zipfile
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io import ros_messages as ros
from mocap_jax.io.mcap_read import DAMAGE, Contents, read_contents
from mocap_jax.io.mcap_trajectory import add_trajectory, file_start, read_trajectory
from mocap_jax.io.mcap_write import FORMAT_VERSION, METADATA_NAME, McapFile, stamps_from_seconds
from mocap_jax.io.setup_toml import setup_from_toml, setup_to_toml
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

_INERTIAL, _MAGNETIC, _TRUTH = "/inertial/", "/magnetic/", "/truth"
_RANGE, _ROOT, _TEMPERATURE = "/range", "/root", "/temperature"
_TRUE_BODY, _TRUE_PARAMETERS = "truth/body.xml", "truth/parameters.npz"
_TOPICS = "/inertial/<sensor>, /magnetic/<sensor>, /range, /root, /temperature, /truth/..."


def write_recording(path: str | os.PathLike[str], recording: Recording) -> None:
    """Write a recording to an MCAP file, whole or not at all.

    Values keep all their digits; times are stored in whole nanoseconds since 1970 (0.5 ns of
    rounding). What cannot be done without (body, set-up) stands first, so that it survives a
    truncation.

    Args:
        path: file to write; an earlier one is replaced once the new one is complete.
        recording: what to write.

    Raises:
        InputError: the file cannot be written, or a time is not finite.
    """
    file = McapFile("recording", recording.start_utc_ns, {"subject": recording.subject})
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
    if (air := recording.temperature) is not None:
        stamps = stamps_from_seconds(air.time, file.start_utc_ns, _TEMPERATURE)
        payloads = ros.encode_temperature(stamps, np.asarray(air.celsius, np.float64))
        file.add_topic(_TEMPERATURE, ros.TEMPERATURE, stamps, payloads)
    file.write(path)


def read_recording(path: str | os.PathLike[str]) -> Recording:
    """Read a recording from an MCAP file.

    A truncated or damaged file gives what is sound; `Recording.salvage` then says what was lost.
    Measurements are not checked here: see `validate_recording`.

    Args:
        path: MCAP file with the topics of the documentation; attachments may be absent.

    Raises:
        InputError: not an MCAP file, not a recording, written by a newer format version, or
            nothing can be read from it.
    """
    contents = read_contents(path)
    _refuse_foreign(path, contents)
    reader = _Reader(path, contents)
    return reader.recording()


# Writing


def _add_inertial(file: McapFile, sensor: str, stream: InertialStream, setup: Setup) -> None:
    stamps = stamps_from_seconds(stream.time, file.start_utc_ns, _INERTIAL + sensor)
    noise = setup.noise
    payloads = ros.encode_imu(
        sensor,
        stamps,
        np.asarray(stream.orientation, np.float64),
        np.asarray(stream.gyroscope, np.float64),
        np.asarray(stream.accelerometer, np.float64),
        (noise.orientation, noise.gyroscope, noise.accelerometer),
    )
    file.add_topic(_INERTIAL + sensor, ros.IMU, stamps, payloads)


def _add_magnetic(file: McapFile, sensor: str, stream: MagneticStream, setup: Setup) -> None:
    stamps = stamps_from_seconds(stream.time, file.start_utc_ns, _MAGNETIC + sensor)
    field = np.asarray(stream.field, np.float64)
    payloads = ros.encode_magnetic(sensor, stamps, field, setup.noise.magnetometer)
    file.add_topic(_MAGNETIC + sensor, ros.MAGNETIC_FIELD, stamps, payloads)


def _add_ranges(file: McapFile, ranges: RangeStream | None) -> None:
    if ranges is None:
        return
    stamps = stamps_from_seconds(ranges.time, file.start_utc_ns, _RANGE)
    payloads = pb.encode_ranges(
        stamps,
        [ranges.source_names[i] for i in np.asarray(ranges.source).tolist()],
        [ranges.receiver_names[i] for i in np.asarray(ranges.receiver).tolist()],
        np.asarray(ranges.distance, np.float64),
        np.asarray(ranges.confidence, np.float64),
    )
    # Names without a single distance would be lost otherwise, and so would their order.
    names = {
        "sources": json.dumps(ranges.source_names),
        "receivers": json.dumps(ranges.receiver_names),
    }
    file.add_topic(_RANGE, pb.Range, stamps, payloads, names)


def _add_root(file: McapFile, root: RootStream | None) -> None:
    if root is None:
        return
    stamps = stamps_from_seconds(root.time, file.start_utc_ns, _ROOT)
    position = np.asarray(root.position, np.float64)
    payloads = pb.encode_poses("world", stamps, position, np.asarray(root.orientation, np.float64))
    file.add_topic(_ROOT, pb.PoseInFrame, stamps, payloads)


def _add_truth(file: McapFile, truth: Truth | None) -> None:
    if truth is None:
        return
    file.attach(_TRUE_BODY, "application/xml", truth.body_xml)
    if truth.parameters:
        buffer = io.BytesIO()
        np.savez(buffer, **{k: np.asarray(v) for k, v in truth.parameters.items()})
        file.attach(_TRUE_PARAMETERS, "application/octet-stream", buffer.getvalue())
    add_trajectory(file, _TRUTH, load_body(truth.body_xml), truth.trajectory, "truth/")


# Reading


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
    known = (_INERTIAL, _MAGNETIC, _RANGE, _ROOT, _TEMPERATURE, _TRUTH)
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
            inertial=self._all(_INERTIAL, self._inertial),
            ranges=self._one(_RANGE, self._ranges),
            root=self._one(_ROOT, self._root),
            magnetic=self._all(_MAGNETIC, self._magnetic),
            temperature=self._one(_TEMPERATURE, self._temperature),
            truth=self._truth(),
            setup=self._setup(),
            body_xml=self._text("body.xml"),
            start_utc_ns=self._start,
            subject=self._contents.metadata.get(METADATA_NAME, {}).get("subject", ""),
        )
        if recording.body_xml is None and self._contents.damage:
            self._lost.append("the body model (attachment body.xml) is lost")
        return replace(recording, salvage=self._contents.damage + tuple(self._lost))

    def _all(self, prefix, read):  # type: ignore[no-untyped-def]
        found = {name: self._one(topic, read) for name, topic in
                 self._contents.topics(prefix).items()}  # fmt: skip
        kept = {name: stream for name, stream in found.items() if stream is not None}
        if self._contents.damage:
            for name in [n for n, stream in kept.items() if not len(stream.time)]:
                self._lost.append(f"topic {prefix}{name}: all samples are lost")
                del kept[name]
        return kept

    def _one(self, topic, read):  # type: ignore[no-untyped-def]
        if topic not in self._contents.channels:
            return None
        try:
            return read(topic)
        except DAMAGE as error:
            self._lost.append(f"topic {topic} cannot be decoded ({' '.join(str(error).split())})")
            return None

    def _time(self, stamps: np.ndarray) -> jnp.ndarray:
        return jnp.asarray((stamps - self._start) / 1e9)

    def _messages(self, topic: str):  # type: ignore[no-untyped-def]
        return self._contents.payloads[topic], self._contents.schema(topic)

    def _inertial(self, topic: str) -> InertialStream:
        stamps, orientation, gyroscope, accelerometer = ros.decode_imu(*self._messages(topic))
        return InertialStream(
            self._time(stamps), jnp.asarray(accelerometer), jnp.asarray(gyroscope),
            jnp.asarray(orientation),
        )  # fmt: skip

    def _magnetic(self, topic: str) -> MagneticStream:
        stamps, field = ros.decode_magnetic(*self._messages(topic))
        return MagneticStream(self._time(stamps), jnp.asarray(field))

    def _temperature(self, topic: str) -> TemperatureStream:
        stamps, celsius = ros.decode_temperature(*self._messages(topic))
        return TemperatureStream(self._time(stamps), jnp.asarray(celsius))

    def _root(self, topic: str) -> RootStream:
        stamps, position, orientation = pb.decode_poses(self._contents.payloads[topic])
        return RootStream(self._time(stamps), jnp.asarray(position), jnp.asarray(orientation))

    def _ranges(self, topic: str) -> RangeStream:
        stamps, source, receiver, distance, confidence = pb.decode_ranges(
            self._contents.payloads[topic]
        )
        declared = self._contents.channels[topic].metadata
        sources = _names(declared.get("sources"), source)
        receivers = _names(declared.get("receivers"), receiver)
        return RangeStream(
            self._time(stamps), _indices(source, sources), _indices(receiver, receivers),
            jnp.asarray(distance), jnp.asarray(confidence), sources, receivers,
        )  # fmt: skip

    def _truth(self) -> Truth | None:
        if not self._contents.topics(_TRUTH + "/"):
            return None
        xml = self._text(_TRUE_BODY)
        if xml is None:
            self._lost.append(f"the truth is lost: no sound attachment {_TRUE_BODY}")
            return None
        try:
            trajectory = read_trajectory(self._contents, _TRUTH, load_body(xml).topology)
        except (InputError, *DAMAGE) as error:
            self._lost.append(f"the truth is lost: {error}")
            return None
        return Truth(trajectory, xml, self._true_parameters())

    def _true_parameters(self) -> dict[str, jnp.ndarray]:
        raw = self._contents.attachments.get(_TRUE_PARAMETERS)
        if raw is None:
            return {}
        try:
            with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:
                return {name: jnp.asarray(arrays[name]) for name in arrays.files}
        except (zipfile.BadZipFile, *DAMAGE) as error:
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


def _indices(found: list[str], names: tuple[str, ...]) -> jnp.ndarray:
    index = {name: i for i, name in enumerate(names)}
    return jnp.asarray(np.array([index[name] for name in found], np.int64))
