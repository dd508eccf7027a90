"""What tells one compiled program from another, in this process and on disk."""

from __future__ import annotations

import functools
import hashlib
import io
import os
import pickle
import platform
import types
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import jaxlib

from mocap_jax.compilation_cache import COMPILER_OPTIONS

# Rooms whose source, or version, is part of a key.
_KNOWN = {__package__, "builtins", "copyreg", "functools", "jax", "jaxlib", "numpy"}


def call_key(function: tuple[str, str], static: Any, tree: Any, kinds: Sequence[Any]) -> str:
    """Digest of what a program is traced from.

    Args:
        function: its module and name, in this package.
        static: values of its static arguments.
        tree: structure of the others.
        kinds: shapes and types of their leaves.

    Raises:
        Exception: a static argument cannot be written down, or its name does not say what it does.
    """
    structure = jax.tree.unflatten(tree, written(kinds))
    about = (function, source()), static, structure, settings(), surroundings()
    return digest(_plain_pickle(about))


def executable_key(text: str, kinds: Sequence[Any]) -> str:
    """Digest of what an executable is compiled from.

    Args:
        text: of the program.
        kinds: shapes and types of the arguments: the text does not name those that are not used.
    """
    return digest(repr((text, written(kinds), settings(), surroundings())).encode())


def written(kinds: Sequence[Any]) -> list[str]:
    """Shapes and types as text."""
    return [f"{k} {k.weak_type}" for k in kinds]


def digest(text: bytes) -> str:
    """A short digest for the name of a file."""
    return hashlib.sha256(text).hexdigest()[:32]


class _Pickler(pickle.Pickler):
    """Bytes that do not depend on which equal parts are the same object.

    Functions and classes are written by name: only those whose source is part of the key, or that
    belong to the libraries whose versions are, say what they do by it.
    """

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file, protocol=5)
        self.fast = True

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, (type, types.FunctionType, types.BuiltinFunctionType)):
            room = (value.__module__ or "").split(".")[0]
            if room not in _KNOWN:
                raise pickle.PicklingError(f"{room}: its source is not part of the key")
        return NotImplemented


def _plain_pickle(value: Any) -> bytes:
    with io.BytesIO() as file:
        _Pickler(file).dump(value)
        return file.getvalue()


@functools.cache
def source() -> str:
    """Digest of the package's source."""
    source, folder = hashlib.sha256(), Path(__file__).parent
    for path in sorted(folder.rglob("*.py")):
        source.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return source.hexdigest()


def device() -> jax.Device:
    """Where programs run."""
    chosen = jax.config.jax_default_device
    return chosen if isinstance(chosen, jax.Device) else jax.local_devices(backend=chosen)[0]


def settings() -> tuple[Any, ...]:
    """What may change in a process and makes it another program."""
    chosen = device()
    return (
        jax.config.jax_enable_x64, jax.config.jax_default_matmul_precision,
        (chosen.platform, chosen.device_kind, chosen.id, chosen.client.platform_version),
    )  # fmt: skip


@functools.cache
def surroundings() -> tuple[Any, ...]:
    """What an executable depends on beside its program: libraries, processor, options."""
    return (
        jax.__version__, jaxlib.__version__, sorted(COMPILER_OPTIONS.items()),
        os.environ.get("XLA_FLAGS"), _processor(),
    )  # fmt: skip


def _processor() -> str:
    """Instructions of this processor: folders of users are shared between machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(x for x in lines if x.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        return " ".join(platform.uname()[4:])
