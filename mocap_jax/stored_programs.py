"""Compiled programs kept on disk, found again without tracing what they compute.

JAX's own cache spares a later process the compiler, but neither tracing nor lowering, which for the
programs of the estimators take longer than loading them. Here the key is what a program is traced
from: the package's source, static arguments, shapes and types of the others.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import io
import os
import pickle
import platform
import tempfile
import threading
import types
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import jax
import jaxlib
from jax.experimental import serialize_executable

from mocap_jax.compilation_cache import COMPILER_OPTIONS

T = TypeVar("T")

_KNOWN = {__package__, "builtins", "copyreg", "functools", "jax", "jaxlib", "numpy"}


class _Loaded(NamedTuple):
    call: Callable[..., Any]
    result: Any
    """Shapes and types of what it returns."""


class _Note(NamedTuple):
    """Which executable a call asks for. Other source may ask for the same one."""

    executable: Path
    result: Any


class StoredProgram(Generic[T]):
    """A function compiled as by `jax.jit`, whose executables are kept in the compilation cache.

    Without such a folder (see `enable_compilation_cache`) they are kept in memory only. It cannot
    be called inside another traced function.

    Args:
        function: of its arguments alone; all are given by position.
        static: which arguments are constants of the program, hashable.
    """

    def __init__(self, function: Callable[..., T], *, static: Sequence[str] = ()) -> None:
        functools.update_wrapper(self, function)
        self._name = function.__name__
        names = list(inspect.signature(function).parameters)
        self._static = tuple(names.index(n) for n in static)
        self._jitted = jax.jit(
            function, static_argnums=self._static, compiler_options=COMPILER_OPTIONS
        )
        self._loaded: dict[Any, _Loaded] = {}
        self._lock = threading.Lock()

    def __call__(self, *args: Any) -> T:
        """The function's result."""
        return self._find(args).call(*self._traced(args))

    def prepare(self, *args: Any) -> Any:
        """Compile or load the program for arguments of these shapes (arrays or `ShapeDtypeStruct`).

        Returns:
            Shapes and types of its result.
        """
        return self._find(args).result

    def _traced(self, args: Sequence[Any]) -> list[Any]:
        return [a for i, a in enumerate(args) if i not in self._static]

    def _find(self, args: Sequence[Any]) -> _Loaded:
        leaves, tree = jax.tree.flatten(self._traced(args))
        kinds = tuple(jax.api_util.shaped_abstractify(x) for x in leaves)
        static = tuple(args[i] for i in self._static)
        key = static, tree, kinds, jax.config.jax_enable_x64
        found = self._loaded.get(key)
        if found is None:
            with self._lock:  # another thread may be compiling it
                found = self._loaded.get(key) or self._load(args, (static, tree, kinds))
                self._loaded[key] = found
        return found

    def _load(self, args: Sequence[Any], key: tuple[Any, Any, Any]) -> _Loaded:
        note = self._note(*key)
        arguments = jax.tree.structure((tuple(self._traced(args)), {}))
        if (known := _note_at(note)) and (call := _read(known.executable, arguments, known.result)):
            return _Loaded(call, known.result)
        lowered = self._jitted.lower(*args)
        result = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), lowered.out_info)
        if note is None:
            return _Loaded(lowered.compile(), result)
        # The text does not name unused arguments; an executable checks them all the same.
        text = lowered.as_text() + repr((_written(key[2]), _surroundings()))
        path = note.with_name(f"{self._name}-{_digest(text.encode())}.executable")
        call = _read(path, arguments, result) or _compiled_to(path, lowered)
        if path.exists():
            _write(note, _Note(path, result))
        return _Loaded(call, result)

    def _note(self, static: Any, tree: Any, kinds: Sequence[Any]) -> Path | None:
        """Where it is kept which executable these arguments ask for; None where it cannot be."""
        folder = jax.config.jax_compilation_cache_dir
        if not folder:
            return None
        structure = jax.tree.unflatten(tree, _written(kinds))
        about = self.__module__, self._name, static, structure, _source(), _surroundings()
        try:
            text = _plain_pickle(about)
        except Exception:  # not every static argument can be written down (a residual of the user)
            return None
        return Path(folder, f"{self._name}-{_digest(text)}.program")


def _written(kinds: Sequence[Any]) -> list[str]:
    return [f"{k} {k.weak_type}" for k in kinds]


def _digest(text: bytes) -> str:
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
def _source() -> str:
    """Digest of the package's source."""
    source, folder = hashlib.sha256(), Path(__file__).parent
    for path in sorted(folder.rglob("*.py")):
        source.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return source.hexdigest()


@functools.cache
def _surroundings() -> tuple[Any, ...]:
    """What an executable depends on beside its program: libraries, processor, options."""
    flags = ("XLA_FLAGS", "JAX_DEFAULT_MATMUL_PRECISION")
    return (
        jax.__version__, jaxlib.__version__, sorted(COMPILER_OPTIONS.items()),
        [os.environ.get(f) for f in flags], [(d.platform, d.device_kind) for d in jax.devices()],
        _processor(),
    )  # fmt: skip


def _processor() -> str:
    """Instructions of this processor: folders of users are shared between machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(x for x in lines if x.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        return " ".join(platform.uname()[4:])


class _Hits(threading.local):
    count: int = 0


_hits = _Hits()


def _count_hits(event: str, **_: object) -> None:
    if event == "/jax/compilation_cache/cache_hits":
        _hits.count += 1


jax.monitoring.register_event_listener(_count_hits)


def _compiled_to(path: Path, lowered: jax.stages.Lowered) -> jax.stages.Compiled:
    """Compile a program and keep it, unless JAX's own cache had it.

    What was loaded once cannot be kept again: XLA leaves out functions that it then misses.
    """
    before = _hits.count
    compiled = lowered.compile()
    if _hits.count == before:
        with contextlib.suppress(Exception):  # a program that cannot be written down
            _write(path, serialize_executable.serialize(compiled)[0])
    return compiled


@functools.cache
def _ready_to_load() -> None:
    """Have JAX find LAPACK, as it does when it lowers a call of it: loaded programs call it."""
    jax.jit(jax.numpy.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), jax.numpy.float32))


def _note_at(path: Path | None) -> _Note | None:
    """A note; None if there is none that can be read: absent, cut short, of another version."""
    try:
        note = pickle.loads(path.read_bytes()) if path else None
    except Exception:
        return None
    return note if isinstance(note, _Note) else None


def _read(path: Path, arguments: Any, result: Any) -> jax.stages.Compiled | None:
    """A kept executable; None as above, and it is compiled and kept anew."""
    try:
        executable = pickle.loads(path.read_bytes())
        _ready_to_load()
        return serialize_executable.deserialize_and_load(
            executable, arguments, jax.tree.structure(result)
        )
    except Exception:
        return None


def _write(path: Path, value: object) -> None:
    """Keep something, whole or not at all; where that fails the next process compiles again."""
    with (
        contextlib.suppress(OSError),
        tempfile.TemporaryDirectory(dir=path.parent) as folder,
    ):
        whole = Path(folder, path.name)
        whole.write_bytes(pickle.dumps(value))
        os.replace(whole, path)
