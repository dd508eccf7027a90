"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from mocap_jax.errors import InputError


@contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path` that takes its place once the block has succeeded.

    An earlier file at `path` stays as it was until then, and whenever the block raises; nothing
    else is left in the folder.

    Raises:
        InputError: the file cannot be written there (path and reason are named).
    """
    target = _target(path)
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with open(temporary, "xb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, target)
    except OSError as error:
        raise InputError(f"{path}: cannot write: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def _target(path: str | os.PathLike[str]) -> Path:
    """The file to replace, once it is known that it may be."""
    try:
        # A link keeps pointing at its target, which is what is replaced.
        target = Path(os.path.realpath(path))
        reason = _reason_against(target)
    except (OSError, ValueError) as error:  # Names too long or with NUL characters.
        raise InputError(f"{path!r}: cannot write: {error}") from error
    if reason:
        raise InputError(f"{path}: cannot write: {reason}")
    return target


def _reason_against(target: Path) -> str:
    if target.is_dir():
        return "it is a folder (name a file)"
    if not target.parent.is_dir():
        return f"no folder {target.parent}"
    if target.exists() and not target.is_file():
        return "it is not a regular file"
    if target.exists() and not os.access(target, os.W_OK):
        return "the file is read-only"
    return ""
