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
import time
import types
import weakref
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import jax
import jaxlib
from jax.experimental import serialize_executable
from jax.experimental.compilation_cache import compilation_cache

from mocap_jax.compilation_cache import COMPILER_OPTIONS

T = TypeVar("T")

_KNOWN = {__package__, "builtins", "copyreg", "functools", "jax", "jaxlib", "numpy"}
# An option without effect: with the same ones, JAX returns what it compiled before.
_AGAIN: dict[str, bool | str] = {"xla_dump_max_hlo_modules": "1"}
# Files that were not used for this long are removed [s].
_KEPT = 90 * 24 * 3600.0


class _Loaded(NamedTuple):
    call: Callable[..., Any]
    result: Any
    """Shapes and types of what it returns."""


class _Note(NamedTuple):
    """Which executable a call asks for. Other source may ask for the same one."""

    executable: str
    """Its file, beside the note."""
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
        _programs.add(self)

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
        key = static, tree, kinds, _settings()
        found = self._loaded.get(key)
        if found is None:
            with self._lock:  # another thread may be compiling it
                found = self._loaded.get(key) or self._load(args, (static, tree, kinds))
                self._loaded[key] = found
        return found

    def _load(self, args: Sequence[Any], key: tuple[Any, Any, Any]) -> _Loaded:
        note = self._note(*key)
        arguments = jax.tree.structure((tuple(self._traced(args)), {}))
        if note and (known := _note_at(note)):
            call = _read(note.with_name(known.executable), arguments, known.result)
            if call:
                return _Loaded(call, known.result)
        lowered = self._jitted.lower(*args)
        result = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), lowered.out_info)
        if note is None:
            return _Loaded(lowered.compile(), result)
        # The text does not name unused arguments; an executable checks them all the same.
        text = lowered.as_text() + repr((_written(key[2]), _settings(), _surroundings()))
        path = note.with_name(f"{self._name}-{_digest(text.encode())}.executable")
        call = _read(path, arguments, result) or _compiled_to(path, lowered)
        if path.exists():
            _write(note, _Note(path.name, result))
        return _Loaded(call, result)

    def _note(self, static: Any, tree: Any, kinds: Sequence[Any]) -> Path | None:
        """Where it is kept which executable these arguments ask for; None where it cannot be."""
        folder = jax.config.jax_compilation_cache_dir
        if not folder or not jax.config.jax_enable_compilation_cache:
            return None
        structure = jax.tree.unflatten(tree, _written(kinds))
        function = self.__module__, self._name, _source()
        try:
            text = _plain_pickle((function, static, structure, _settings(), _surroundings()))
        except Exception:  # not every static argument can be written down (a residual of the user)
            return None
        return Path(folder, f"{self._name}-{_digest(text)}.program")


_programs: weakref.WeakSet[StoredProgram] = weakref.WeakSet()


def _after_fork() -> None:
    # A thread that is not in the forked process may have held a lock.
    for program in _programs:
        program._lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


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


def _device() -> jax.Device:
    """Where programs run."""
    chosen = jax.config.jax_default_device
    return chosen if isinstance(chosen, jax.Device) else jax.local_devices(backend=chosen)[0]


def _settings() -> tuple[Any, ...]:
    """What may change in a process and makes it another program."""
    device = _device()
    return (
        jax.config.jax_enable_x64, jax.config.jax_default_matmul_precision,
        (device.platform, device.device_kind, device.id, device.client.platform_version),
    )  # fmt: skip


@functools.cache
def _surroundings() -> tuple[Any, ...]:
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


class _Hits(threading.local):
    count: int = 0


_hits = _Hits()


def _count_hits(event: str, **_: object) -> None:
    if event == "/jax/compilation_cache/cache_hits":
        _hits.count += 1


jax.monitoring.register_event_listener(_count_hits)


def _compiled_to(path: Path, lowered: jax.stages.Lowered) -> jax.stages.Compiled:
    """Compile a program and keep it.

    What JAX's own cache had cannot be kept: of an executable that was loaded, XLA writes too little
    to load it again. Then it is compiled once more.
    """
    before = _hits.count
    compiled = lowered.compile()
    if _hits.count > before:
        with _without_jax_cache():
            compiled = lowered.compile(compiler_options=_AGAIN)
    with contextlib.suppress(Exception):  # a program that cannot be written down
        _write(path, serialize_executable.serialize(compiled)[0])
    return compiled


@contextlib.contextmanager
def _without_jax_cache() -> Iterator[None]:
    jax.config.update("jax_enable_compilation_cache", False)
    compilation_cache.reset_cache()  # JAX asks once whether there is one
    try:
        yield
    finally:
        jax.config.update("jax_enable_compilation_cache", True)
        compilation_cache.reset_cache()


@functools.cache
def _ready_to_load() -> None:
    """Have JAX find LAPACK, as it does when it lowers a call of it: loaded programs call it."""
    jax.jit(jax.numpy.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), jax.numpy.float32))


def _note_at(path: Path) -> _Note | None:
    """A note; None if there is none that can be read: absent, cut short, of another version."""
    try:
        note = pickle.loads(path.read_bytes())
    except Exception:
        return None
    return note if isinstance(note, _Note) else None


def _read(path: Path, arguments: Any, result: Any) -> jax.stages.Compiled | None:
    """A kept executable; None as above, and it is compiled and kept anew."""
    begin, device = time.perf_counter(), _device()
    try:
        executable = pickle.loads(path.read_bytes())
        _ready_to_load()
        loaded = serialize_executable.deserialize_and_load(
            executable, arguments, jax.tree.structure(result), device.client, [device]
        )
    except Exception:
        return None
    finally:
        # Counted among JAX's own times of compilation.
        seconds = time.perf_counter() - begin
        jax.monitoring.record_event_duration_secs("/jax/core/compile/load_duration", seconds)
    with contextlib.suppress(OSError):
        os.utime(path)  # see `_remove_unused`
    return loaded


def _write(path: Path, value: object) -> None:
    """Keep something, whole or not at all; where that fails the next process compiles again."""
    with (
        contextlib.suppress(OSError),
        tempfile.TemporaryDirectory(dir=path.parent) as folder,
    ):
        whole = Path(folder, path.name)
        whole.write_bytes(pickle.dumps(value))
        os.replace(whole, path)
        _remove_unused(path.parent)


def _remove_unused(folder: Path) -> None:
    """Executables that no process loaded for long, and notes as old."""
    for path in (*folder.glob("*.program"), *folder.glob("*.executable")):
        with contextlib.suppress(OSError):
            if time.time() - path.stat().st_mtime > _KEPT:
                path.unlink()
