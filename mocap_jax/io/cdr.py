"""CDR, the wire format of ROS 2, for messages of constant text followed by doubles.

All messages of one of our topics differ only in their stamp and in one block of doubles, so a
whole stream is encoded or decoded as one array instead of field by field.

Layout: 4 bytes encapsulation header, then the body: stamp (int32 s, uint32 ns), `frame_id`
(uint32 length with the final NUL, characters), further constant fields, the doubles aligned to 8
bytes from the start of the body, and constant bytes after them.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
_STAMP = 8
_SECOND = 1_000_000_000


def align(body: bytearray, size: int) -> None:
    """Pad the body with zeros to a multiple of `size` bytes."""
    body.extend(bytes(-len(body) % size))


def put_string(body: bytearray, text: str) -> None:
    """Append a string with its length."""
    raw = text.encode() + b"\x00"
    put_count(body, len(raw))
    body.extend(raw)


def put_count(body: bytearray, count: int) -> None:
    """Append an unsigned 32-bit integer."""
    align(body, 4)
    body.extend(struct.pack("<I", count))


def start_body(frame_id: str) -> bytearray:
    """Body of a stamped message up to the end of its header (stamp zero)."""
    body = bytearray(_STAMP)
    put_string(body, frame_id)
    return body


def encode(
    body: bytearray, stamps_ns: np.ndarray, doubles: np.ndarray, tail: bytes = b""
) -> list[bytes]:
    """Encode n messages.

    Args:
        body: constant start of the body, with room for the stamp in its first 8 bytes.
        stamps_ns: stamps, shape (n,), nanoseconds.
        doubles: values, shape (n, k).
        tail: constant end of the body.
    """
    align(body, 8)
    head = _LITTLE_ENDIAN + bytes(body)
    n, k = doubles.shape
    width = len(head) + 8 * k + len(tail)
    block = np.empty((n, width), np.uint8)
    block[:, : len(head)] = np.frombuffer(head, np.uint8)
    seconds, nanoseconds = np.divmod(stamps_ns, _SECOND)
    block[:, 4:8] = _bytes(seconds.astype("<i4")[:, None])
    block[:, 8:12] = _bytes(nanoseconds.astype("<u4")[:, None])
    block[:, len(head) : len(head) + 8 * k] = _bytes(doubles.astype("<f8"))
    block[:, width - len(tail) :] = np.frombuffer(tail, np.uint8)
    raw = block.tobytes()
    return [raw[i : i + width] for i in range(0, n * width, width)]


def decode(payloads: Sequence[bytes], skip: int, k: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Decode n messages that differ in stamp and doubles only.

    Args:
        payloads: the messages.
        skip: bytes between the end of `frame_id` and the doubles, without alignment padding.
        k: number of doubles.

    Returns:
        Stamps [ns] (n,) and values (n, k); None if the messages are not so uniform (then each
        must be decoded by itself).
    """
    first = payloads[0]
    if len(first) < 16 or first[:4] != _LITTLE_ENDIAN:
        return None
    frame_id_end = _STAMP + 4 + struct.unpack_from("<I", first, 12)[0]
    start = 4 + -(-(frame_id_end + skip) // 8) * 8
    width = len(first)
    if start + 8 * k > width or any(len(p) != width for p in payloads):
        return None
    block = np.frombuffer(b"".join(payloads), np.uint8).reshape(-1, width)
    if (block[:, 12:start] != block[0, 12:start]).any():
        return None
    seconds = block[:, 4:8].copy().view("<i4")[:, 0].astype(np.int64)
    nanoseconds = block[:, 8:12].copy().view("<u4")[:, 0].astype(np.int64)
    doubles = block[:, start : start + 8 * k].copy().view("<f8").astype(np.float64)
    return seconds * _SECOND + nanoseconds, doubles


def _bytes(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values).view(np.uint8)
