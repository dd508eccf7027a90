"""Raw recordings of a driver box: written and read piece by piece, in bounded memory."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import asdict, fields, replace
from pathlib import Path

import numpy as np
import tomli_w
from jaxtyping import Float, Int16
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io.mcap_read import DAMAGE, Contents
from mocap_jax.io.mcap_write import METADATA_NAME
from mocap_jax.io.recording_reader import recording_from
from mocap_jax.io.recording_writer import mcap_file
from mocap_jax.io.setup_toml import setup_from_toml
from mocap_jax.io.topics import ACOUSTIC, DRIVER_BOX, PULSE, SETUP
from mocap_jax.recording import DriverBox, Recording, Setup

Piece = tuple[int, Int16[np.ndarray, "r count"]]


def write_raw(
    path: str | os.PathLike[str],
    recording: Recording,
    box: DriverBox,
    *,
    sample_rate_hz: float,
    wires: tuple[str, ...],
    pulse_time: Float[np.ndarray, "n"],
    pulse_source: np.ndarray,
    pieces: Iterable[Piece],
) -> None:
    """Write a raw recording, whole or not at all.

    Args:
        path: the file.
        recording: everything but the wires: set-up, body, root, temperature, truth.
        box: figures that decoding needs.
        sample_rate_hz: of the wires.
        wires: sensor names.
        pulse_time: emissions, ascending [s].
        pulse_source: their indices into the set-up's sources.
        pieces: index of the first sample and samples of all wires, in order.

    Raises:
        InputError: the file cannot be written.
    """
    file = mcap_file(recording, "raw")
    figures = asdict(box)
    for later in ("source_frequency_hz", "receiver_celsius"):
        if not figures[later]:  # as files were before there were these
            del figures[later]
    file.attach(DRIVER_BOX, "application/toml", tomli_w.dumps(figures))
    none = np.zeros(0, np.int64)
    for name in wires:
        file.add_topic(ACOUSTIC + name, pb.Waveform, none, [])
    file.add_topic(PULSE, pb.Pulse, none, [])
    start = recording.start_utc_ns
    stamps = np.rint(np.asarray(pulse_time) * 1e9).astype(np.int64) + start
    names = [recording.setup.sources[i] for i in pulse_source]
    file.streamed = _streamed(pieces, start, sample_rate_hz, wires, stamps, names)
    file.write(path)


def _streamed(
    pieces: Iterable[Piece],
    start: int,
    rate: float,
    wires: tuple[str, ...],
    stamps: np.ndarray,
    names: list[str],
) -> Iterator[tuple[str, int, int, bytes]]:
    """Pieces are logged when they are complete, behind the pulses that fall into them."""
    done = 0
    for first, samples in pieces:
        begin = start + round(first / rate * 1e9)
        end = start + round((first + samples.shape[1]) / rate * 1e9)
        while done < len(stamps) and stamps[done] <= end:
            stamp = int(stamps[done])
            yield PULSE, stamp, stamp, pb.encode_pulse(stamp, names[done])
            done += 1
        for name, wire in zip(wires, samples, strict=True):
            yield ACOUSTIC + name, end, begin, pb.encode_waveform(begin, rate, wire)


class RawReader:
    """Reads a raw recording from front to back.

    Args:
        path: the file.

    Raises:
        InputError: not there, or not a raw recording.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = path
        self._contents = Contents()
        self._topics: dict[int, str] = {}
        try:
            self.size = Path(path).stat().st_size
            with open(path, "rb") as stream:
                if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                    raise InputError(f"{path}: not an MCAP file (expected a raw recording)")
        except OSError as error:
            raise InputError(f"{path}: cannot read: {error.strerror or error}") from error
        self.read_bytes = 0
        self.damage: tuple[str, ...] = ()

    def messages(self) -> Iterator[tuple[str, bytes]]:
        """Topic and payload of all messages on wires, of pulses and of temperature, in order.

        All other messages are kept for `recording`. A file that ends early or is damaged gives
        what stands before the damage; `damage` says so.
        """
        with open(self._path, "rb") as stream:
            try:
                for record in StreamReader(stream, validate_crcs=True).records:
                    self.read_bytes = stream.tell()
                    if isinstance(record, Message):
                        topic = self._topics[record.channel_id]
                        if topic.startswith((ACOUSTIC, PULSE)):
                            yield topic, record.data
                        else:
                            self._contents.payloads[topic].append(record.data)
                    else:
                        self._note(record)
            except DAMAGE as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                self.damage = (f"read to byte {self.read_bytes} of {self.size} only ({reason})",)
                self._contents.damage = self.damage

    def _note(self, record: object) -> None:
        if isinstance(record, Schema):
            self._contents.schemas[record.id] = record
        elif isinstance(record, Channel):
            self._topics[record.id] = record.topic
            if not record.topic.startswith((ACOUSTIC, PULSE)):
                self._contents.channels[record.topic] = record
                self._contents.payloads.setdefault(record.topic, [])
        elif isinstance(record, Attachment):
            self._contents.attachments[record.name] = record.data
        elif isinstance(record, Metadata):
            self._contents.metadata[record.name] = record.metadata

    @property
    def wires(self) -> tuple[str, ...]:
        """Sensor names of the wires seen so far."""
        return tuple(t[len(ACOUSTIC) :] for t in self._topics.values() if t.startswith(ACOUSTIC))

    @property
    def start_utc_ns(self) -> int:
        """Absolute start, known once the metadata has been read."""
        return int(self._contents.metadata.get(METADATA_NAME, {}).get("start_utc_ns", 0))

    def driver_box(self) -> DriverBox:
        """The figures of the box; defaults where the file has none.

        Raises:
            InputError: the attachment is wrong.
        """
        raw = self._contents.attachments.get(DRIVER_BOX)
        if raw is None:
            return DriverBox()
        where = f"{self._path}: {DRIVER_BOX}"
        try:
            values = tomllib.loads(raw.decode())
        except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise InputError(f"{where}: {error}") from error
        known = [f.name for f in fields(DriverBox)]
        for name in values:
            if name not in known:
                raise unknown_name(f"{where}: entry", name, known)
        try:
            return DriverBox(**values)
        except InputError as error:
            raise InputError(f"{where}: {error}") from error

    def setup(self) -> Setup:
        """The set-up; defaults where the file has none, or not yet.

        Raises:
            InputError: the attachment is wrong.
        """
        raw = self._contents.attachments.get(SETUP)
        if raw is None:
            return Setup()
        return setup_from_toml(raw.decode(errors="replace"), f"{self._path}: {SETUP}")

    def recording(self) -> Recording:
        """All but the wires; complete once `messages` has ended.

        Raises:
            InputError: the rest is not a recording.
        """
        facts = self._contents.metadata.setdefault(METADATA_NAME, {})
        self._contents.metadata[METADATA_NAME] = facts | {"kind": "recording"}
        found = recording_from(self._path, self._contents)
        return replace(found, salvage=tuple(dict.fromkeys(found.salvage)))
