"""Write MCAP files: what must survive truncation first, then all messages in order of time."""

from __future__ import annotations

import heapq
import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Float, Int
from mcap.writer import Writer
from mcap_protobuf.schema import build_file_descriptor_set

from mocap_jax.errors import InputError
from mocap_jax.io.atomic import atomic_file
from mocap_jax.io.ros_messages import ROS_SCHEMAS

FORMAT_VERSION = 1
METADATA_NAME = "mocap_jax"
ATTACHMENTS = "attachments"
"""Entry of the metadata: names of all attachments, so that a damaged file tells which are lost."""

# Small enough that one damaged chunk costs little, large enough to compress well.
_CHUNK_BYTES = 256 * 1024
_PIECE = 16_384


@dataclass
class _Topic:
    schema: str | Any
    metadata: dict[str, str]
    stamps_ns: np.ndarray
    payloads: Iterable[bytes]


@dataclass
class McapFile:
    """The content of a file to be written."""

    kind: str
    """"recording" or "solution"."""
    start_utc_ns: int = 0
    facts: dict[str, str] = field(default_factory=dict)
    """Further entries of the metadata record."""
    attachments: list[tuple[str, str, bytes]] = field(default_factory=list)
    """Name, media type, content."""
    topics: dict[str, _Topic] = field(default_factory=dict)
    streamed: Iterable[tuple[str, int, int, bytes]] = ()
    """Messages made as the file is written, by ascending log time: topic (declared by
    `add_topic` without messages), log time, stamp [ns], payload."""

    def attach(self, name: str, media_type: str, content: bytes | str) -> None:
        """Add an attachment."""
        raw = content.encode() if isinstance(content, str) else content
        self.attachments.append((name, media_type, raw))

    def add_topic(
        self,
        topic: str,
        schema: str | Any,
        stamps_ns: Int[np.ndarray, "n"],
        payloads: Iterable[bytes],
        metadata: dict[str, str] | None = None,
    ) -> None:
        """Add all messages of one topic.

        Args:
            topic: its name.
            schema: name of a ROS 2 message type of ours, or a protobuf message class.
            stamps_ns: absolute log times [ns].
            payloads: the encoded messages, one a stamp; they may be made as they are asked for.
            metadata: facts about the channel.
        """
        self.topics[topic] = _Topic(schema, metadata or {}, stamps_ns, payloads)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file, whole or not at all.

        Raises:
            InputError: it cannot be written there.
        """
        with atomic_file(path) as stream:
            # The checksum of the data section is what reveals damage outside of chunks.
            writer = Writer(stream, chunk_size=_CHUNK_BYTES, enable_data_crcs=True)
            writer.start(library=f"mocap_jax {version('mocap_jax')}")
            writer.add_metadata(METADATA_NAME, self._metadata())
            for name, media_type, content in self.attachments:
                writer.add_attachment(
                    self.start_utc_ns, self.start_utc_ns, name, media_type, content
                )
            self._write_messages(writer)
            writer.finish()

    def _metadata(self) -> dict[str, str]:
        return {
            "format_version": str(FORMAT_VERSION),
            "kind": self.kind,
            "start_utc_ns": str(self.start_utc_ns),
            "software": f"mocap_jax {version('mocap_jax')}",
            ATTACHMENTS: json.dumps([name for name, *_ in self.attachments]),
            **self.facts,
        }

    def _write_messages(self, writer: Writer) -> None:
        schemas: dict[str, int] = {}
        channel_of: list[int] = []
        for name, topic in self.topics.items():
            encoding = "cdr" if isinstance(topic.schema, str) else "protobuf"
            schema = _register_schema(writer, topic.schema, schemas)
            channel_of.append(writer.register_channel(name, encoding, schema, topic.metadata))
        topics = list(self.topics.values())
        if not topics:
            return
        number = dict(zip(self.topics, channel_of, strict=True))
        streamed = ((log, number[name], p, stamp) for name, log, stamp, p in self.streamed)
        by_time = heapq.merge(self._messages(channel_of), streamed, key=lambda m: m[0])
        for log_time, channel, payload, stamp in by_time:
            writer.add_message(channel, log_time, payload, stamp)

    def _messages(self, channel_of: list[int]) -> Iterator[tuple[int, int, bytes, int]]:
        """Log time, channel, payload and stamp of what is held, by log time."""
        topics = list(self.topics.values())
        if not topics:
            return
        stamps = np.concatenate([np.asarray(t.stamps_ns, np.int64) for t in topics])
        if stamps.size and stamps.min() < 0:
            raise InputError(
                f"times before 1970 cannot be stored (earliest {stamps.min() / 1e9:.3f} s): give "
                "the recording an absolute start (start_utc_ns)"
            )
        # Log times never go backwards within a topic, even where stamps do: the order of a topic's
        # messages is a fact to be kept (and refused by `validate_recording`), not to be repaired.
        log = np.concatenate([np.maximum.accumulate(np.asarray(t.stamps_ns)) for t in topics])
        topic_of = np.repeat(np.arange(len(topics)), [len(t.stamps_ns) for t in topics])
        remaining = [iter(t.payloads) for t in topics]
        order = np.argsort(log, kind="stable")
        # In pieces: numbers of Python for all messages would take more memory than the messages.
        for first in range(0, len(order), _PIECE):
            rows = order[first : first + _PIECE]
            which = topic_of[rows].tolist()
            times = zip(which, log[rows].tolist(), stamps[rows].tolist(), strict=True)
            for k, log_time, stamp in times:
                yield log_time, channel_of[k], next(remaining[k]), stamp


def _register_schema(writer: Writer, schema: str | Any, known: dict[str, int]) -> int:
    if isinstance(schema, str):
        name, encoding, data = schema, "ros2msg", ROS_SCHEMAS[schema].encode()
    else:
        name, encoding = schema.DESCRIPTOR.full_name, "protobuf"
        data = build_file_descriptor_set(schema).SerializeToString()
    if name not in known:
        known[name] = writer.register_schema(name, encoding, data)
    return known[name]


def stamps_from_seconds(
    time: Float[ArrayLike, "n"], start_utc_ns: int, what: str
) -> Int[np.ndarray, "n"]:
    """Absolute stamps [ns] of times [s] since the start, to half a nanosecond.

    Raises:
        InputError: a time is not finite, or lies outside of what ROS 2 stamps hold (1970 to 2038).
    """
    t = np.asarray(time, np.float64)
    if not np.isfinite(t).all():
        raise InputError(f"{what}: {np.count_nonzero(~np.isfinite(t))} times are not finite")
    if t.size and max(abs(t.min()), abs(t.max())) + start_utc_ns / 1e9 >= 2**31:
        raise InputError(
            f"{what}: times up to {np.abs(t).max():g} s after start_utc_ns {start_utc_ns} do "
            "not fit a ROS 2 stamp (32-bit seconds since 1970)"
        )
    return np.rint(t * 1e9).astype(np.int64) + start_utc_ns
