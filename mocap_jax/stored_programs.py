"""Compiled programs kept on disk, found again without tracing what they compute.

JAX's own cache spares a later process the compiler, but neither tracing nor lowering, which for the
programs of the estimators take longer than loading them. Here the key is what a program is traced
from: the package's source, static arguments, shapes and types of the others.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import os
import pickle
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import jax
from jax.experimental import serialize_executable
from jax.experimental.compilation_cache import compilation_cache

from mocap_jax import program_key
from mocap_jax.compilation_cache import COMPILER_OPTIONS

T = TypeVar("T")

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
        key = static, tree, kinds, program_key.settings()
        found = self._loaded.get(key)
        if found is None:
            with self._lock:  # another thread may be compiling it
                found = self._loaded.get(key) or self._load(args, static, tree, kinds)
                self._loaded[key] = found
        return found

    def _load(self, args: Sequence[Any], static: Any, tree: Any, kinds: Sequence[Any]) -> _Loaded:
        note = self._note(static, tree, kinds)
        arguments = jax.tree.structure((tuple(self._traced(args)), {}))
        if note and (known := _note_at(note)):
            call = _read(note.with_name(known.executable), arguments, known.result)
            if call:
                return _Loaded(call, known.result)
        lowered = self._jitted.lower(*args)
        result = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), lowered.out_info)
        if note is None:
            return _Loaded(lowered.compile(), result)
        key = program_key.executable_key(lowered.as_text(), kinds)
        path = note.with_name(f"{self._name}-{key}.executable")
        call = _read(path, arguments, result) or _compiled_to(path, lowered)
        if path.exists():
            _write(note, _Note(path.name, result))
        return _Loaded(call, result)

    def _note(self, static: Any, tree: Any, kinds: Sequence[Any]) -> Path | None:
        """Where it is kept which executable these arguments ask for; None where it cannot be."""
        folder = jax.config.jax_compilation_cache_dir
        if not folder or not jax.config.jax_enable_compilation_cache:
            return None
        function = self.__module__, self._name
        try:
            key = program_key.call_key(function, static, tree, kinds)
        except Exception:  # not every static argument can be written down (a residual of the user)
            return None
        return Path(folder, f"{self._name}-{key}.program")


_programs: weakref.WeakSet[StoredProgram] = weakref.WeakSet()


def forget_programs() -> None:
    """Drop what is compiled and held in memory, JAX's own programs too; files stay.

    For a process that solves for dozens of different suits: each brings its own programs, and a
    process may have so many maps of memory (65 530 on most systems).
    """
    for program in tuple(_programs):
        with program._lock:
            program._loaded.clear()
    jax.clear_caches()


def _after_fork() -> None:
    # A thread that is not in the forked process may have held a lock.
    for program in _programs:
        program._lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


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
    begin, device = time.perf_counter(), program_key.device()
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
