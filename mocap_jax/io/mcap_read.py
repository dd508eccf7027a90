"""Read MCAP files in stream order, keeping everything that is undamaged.

The index at the end of a file is not trusted: a truncated file has none. Records are walked from
the front, each is parsed by itself, and what does not parse is left out and said so. All
exceptions of the MCAP, compression and decoding libraries stay inside this file.
"""

from __future__ import annotations

import os
import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Metadata, Schema, Statistics
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from mocap_jax.errors import InputError

DAMAGE = (
    McapError, struct.error, zstandard.ZstdError, ValueError, OverflowError, RuntimeError,
    KeyError, IndexError, MemoryError, EOFError, TypeError,
)  # fmt: skip
"""What damaged bytes make the libraries raise (CRCValidationError and UnicodeDecodeError are
ValueErrors)."""

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_SUMMARY_ONLY = {
    Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX, Opcode.SUMMARY_OFFSET,
    Opcode.MESSAGE_INDEX,
}  # fmt: skip
# Records of private use start here; between the last known opcode and this none may exist.
_PRIVATE = 0x80


@dataclass
class Contents:
    """What was found in a file."""

    channels: dict[str, Channel] = field(default_factory=dict)
    """By topic."""
    schemas: dict[int, Schema] = field(default_factory=dict)
    payloads: dict[str, list[bytes]] = field(default_factory=dict)
    """Messages by topic, in order of log time."""
    attachments: dict[str, bytes] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    first_log_time: int | None = None
    """Earliest message [ns]."""
    damage: tuple[str, ...] = ()
    """What was lost, one sentence each."""

    def schema(self, topic: str) -> Schema:
        """Schema of a topic's messages."""
        return self.schemas[self.channels[topic].schema_id]

    def topics(self, prefix: str) -> dict[str, str]:
        """Topics that start with a prefix, by the rest of their name."""
        return {t[len(prefix) :]: t for t in self.channels if t.startswith(prefix)}


def read_contents(path: str | os.PathLike[str]) -> Contents:
    """Read an MCAP file as far as it is sound.

    Raises:
        InputError: it cannot be read at all, is not MCAP, or nothing of use is left of it.
    """
    data = _read_bytes(path)
    if not data:
        raise InputError(f"{path}: the file is empty (expected an MCAP recording)")
    if data[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
        kind = "a damaged or foreign file" if data[:1] == MCAP0_MAGIC[:1] else "not an MCAP file"
        raise InputError(f"{path}: {kind} (an MCAP file starts with the bytes 89 'MCAP0')")
    walk = _Walk(data)
    walk.records()
    contents = walk.contents()
    if not contents.channels and not contents.attachments:
        lost = "; ".join(contents.damage) or "it holds no messages and no attachments"
        raise InputError(f"{path}: nothing can be read from this MCAP file: {lost}")
    return contents


def _read_bytes(path: str | os.PathLike[str]) -> bytes:
    try:
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot read: {reason}") from error


class _Walk:
    """One pass over the records of a file."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._messages: dict[int, list[tuple[int, bytes]]] = {}
        self._channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._attachments: dict[str, bytes] = {}
        self._metadata: dict[str, dict[str, str]] = {}
        self._damage: list[str] = []
        self._expected: int | None = None
        self._data_ended = False

    def contents(self) -> Contents:
        """Sort what was found."""
        out = Contents(
            schemas=self._schemas, attachments=self._attachments, metadata=self._metadata
        )
        for number, channel in self._channels.items():
            if channel.schema_id not in self._schemas and channel.schema_id != 0:
                continue
            found = sorted(self._messages.get(number, []), key=lambda m: m[0])
            out.channels[channel.topic] = channel
            out.payloads.setdefault(channel.topic, []).extend(payload for _, payload in found)
        times = [m[0] for messages in self._messages.values() for m in messages]
        out.first_log_time = min(times, default=None)
        orphans = sum(len(m) for c, m in self._messages.items() if c not in self._channels)
        if orphans:
            self._damage.append(f"{orphans} messages lost: their channel's description is damaged")
        if self._expected is not None and len(times) < self._expected:
            self._damage.append(
                f"{self._expected - len(times)} of {self._expected} messages are lost"
            )
        out.damage = tuple(self._damage)
        return out

    def records(self) -> None:
        """Walk all top-level records."""
        data, at = self._data, len(MCAP0_MAGIC)
        while at + _RECORD.size <= len(data):
            opcode, length = _RECORD.unpack_from(data, at)
            start, at = at, at + _RECORD.size
            if not 0 < opcode <= Opcode.DATA_END and opcode < _PRIVATE:
                self._damage.append(f"damaged from byte {start} of {len(data)} on")
                return
            content = data[at : at + length]
            at += length
            if at > len(data):
                if opcode == Opcode.CHUNK:
                    self._partial_chunk(content)
                break
            if opcode == Opcode.FOOTER:
                self._check_end(data, at)
                return
            self._record(opcode, content, start)
        lost = "only its index is missing" if self._data_ended else "later records are missing"
        self._damage.append(f"the file ends early, at byte {len(data)}: {lost}")

    def _record(self, opcode: int, content: bytes, start: int) -> None:
        stream = ReadDataStream(BytesIO(content))
        try:
            if opcode == Opcode.CHUNK:
                self._chunk(Chunk.read(stream))
            elif opcode == Opcode.ATTACHMENT:
                self._attachment(content, stream)
            elif opcode == Opcode.METADATA:
                metadata = Metadata.read(stream)
                self._metadata[metadata.name] = metadata.metadata
            elif opcode == Opcode.DATA_END:
                self._data_end(DataEnd.read(stream).data_section_crc, start)
            elif opcode == Opcode.STATISTICS:
                self._expected = Statistics.read(stream).message_count
            elif opcode not in _SUMMARY_ONLY:
                self._inner(opcode, content)
        except DAMAGE as error:
            kind = Opcode(opcode).name.lower().replace("_", " ")
            self._damage.append(f"{kind} at byte {start} is damaged ({_brief(error)})")

    def _attachment(self, content: bytes, stream: ReadDataStream) -> None:
        attachment = Attachment.read(stream)
        (crc,) = struct.unpack_from("<I", content, len(content) - 4)
        if crc and crc != zlib.crc32(content[:-4]):
            raise ValueError(f"checksum of attachment '{attachment.name[:80]}' differs")
        self._attachments[attachment.name] = attachment.data

    def _data_end(self, crc: int, start: int) -> None:
        self._data_ended = True
        if crc and crc != zlib.crc32(self._data[:start]) and not self._damage:
            self._damage.append("checksum of the data differs: some bytes were changed")

    def _check_end(self, data: bytes, at: int) -> None:
        if data[at : at + len(MCAP0_MAGIC)] != MCAP0_MAGIC:
            self._damage.append("the end of the file is damaged")

    def _chunk(self, chunk: Chunk) -> None:
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        self._inner_records(stream.read(length))

    def _partial_chunk(self, content: bytes) -> None:
        """Messages from the sound start of a chunk that the end of the file cuts off."""
        try:
            chunk = Chunk.read(ReadDataStream(BytesIO(content)))
            if chunk.compression == "zstd":
                data = zstandard.ZstdDecompressor().decompressobj().decompress(chunk.data)
            elif chunk.compression == "":
                data = chunk.data
            else:
                return
            self._inner_records(data)
        except DAMAGE:
            return  # The walk says that the file ends early.

    def _inner_records(self, data: bytes) -> None:
        at, messages, size = 0, self._messages, _MESSAGE.size
        unpack_record, unpack_message = _RECORD.unpack_from, _MESSAGE.unpack_from
        while at + _RECORD.size <= len(data):
            opcode, length = unpack_record(data, at)
            at += _RECORD.size
            end = at + length
            if end > len(data):
                return
            if opcode == Opcode.MESSAGE:
                channel, _, log_time, _ = unpack_message(data, at)
                messages.setdefault(channel, []).append((log_time, data[at + size : end]))
            else:
                self._inner(opcode, data[at:end])
            at = end

    def _inner(self, opcode: int, content: bytes) -> None:
        """Schema, channel or message, in a chunk or outside of any."""
        stream = ReadDataStream(BytesIO(content))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            self._channels.setdefault(channel.id, channel)
        elif opcode == Opcode.MESSAGE:
            number, _, log_time, _ = _MESSAGE.unpack_from(content)
            self._messages.setdefault(number, []).append((log_time, content[_MESSAGE.size :]))


def _brief(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 120 else text[:117] + "..."
