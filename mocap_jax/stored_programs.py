"""Compiled programs kept on disk, found again without tracing what they compute.

JAX's own cache spares a later process the compiler, but neither tracing nor lowering, which for the
programs of the estimators take longer than loading them. Here the key is what a program is traced
from: the package's source, static arguments, shapes and types of the others.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import io
import os
import pickle
import platform
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import jax
import jaxlib
import numpy as np
from jax.experimental import serialize_executable

from mocap_jax.compilation_cache import COMPILER_OPTIONS

T = TypeVar("T")


class _Loaded(NamedTuple):
    call: Callable[..., Any]
    result: Any
    """Shapes and types of what it returns."""


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
        path = self._path(*key)
        kept = path and _read(path, jax.tree.structure((tuple(self._traced(args)), {})))
        if kept:
            return kept
        lowered = self._jitted.lower(*args)
        compiled = lowered.compile()
        result = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), lowered.out_info)
        if path:
            _write(path, compiled, result)
        return _Loaded(compiled, result)

    def _path(self, static: Any, tree: Any, kinds: Sequence[Any]) -> Path | None:
        """Where the program is kept; None where it cannot be."""
        folder = jax.config.jax_compilation_cache_dir
        if not folder:
            return None
        structure = jax.tree.unflatten(tree, [str(k) + str(k.weak_type) for k in kinds])
        try:
            text = _plain_pickle((self.__module__, self._name, static, structure, _surroundings()))
        except Exception:  # not every static argument can be written down (a residual of the user)
            return None
        name = f"{self._name}-{hashlib.sha256(text).hexdigest()[:32]}.program"
        return Path(folder) / name


def _plain_pickle(value: Any) -> bytes:
    """Bytes that do not depend on which equal parts are the same object."""
    with io.BytesIO() as file:
        pickler = pickle.Pickler(file, protocol=5)
        pickler.fast = True
        pickler.dump(value)
        return file.getvalue()


@functools.cache
def _surroundings() -> tuple[Any, ...]:
    """What else a program depends on: source, libraries, processor and options of the compiler."""
    source = hashlib.sha256()
    folder = Path(__file__).parent
    for path in sorted(folder.rglob("*.py")):
        source.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    flags = ("XLA_FLAGS", "JAX_DEFAULT_MATMUL_PRECISION")
    return (
        source.hexdigest(), jax.__version__, jaxlib.__version__, np.__version__,
        sorted(COMPILER_OPTIONS.items()), [os.environ.get(f) for f in flags],
        [(d.platform, d.device_kind) for d in jax.devices()], _processor(),
    )  # fmt: skip


def _processor() -> str:
    """Instructions of this processor: folders of users are shared between machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(x for x in lines if x.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        return " ".join(platform.uname()[4:])


@functools.cache
def _ready_to_load() -> None:
    """Have JAX find LAPACK, as it does when it lowers a call of it: loaded programs call it."""
    jax.jit(jax.numpy.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), jax.numpy.float32))


def _read(path: Path, arguments: Any) -> _Loaded | None:
    """A kept program; None if there is none that can be read."""
    try:
        program, result = pickle.loads(path.read_bytes())
        _ready_to_load()
        call = serialize_executable.deserialize_and_load(
            program, arguments, jax.tree.structure(result)
        )
    except Exception:  # absent, cut short, or of another version: it is compiled and kept anew
        return None
    return _Loaded(call, result)


def _write(path: Path, compiled: jax.stages.Compiled, result: Any) -> None:
    """Keep a program; where that fails the next process compiles again."""
    try:
        program, _, _ = serialize_executable.serialize(compiled)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            whole = Path(folder, path.name)
            whole.write_bytes(pickle.dumps((program, result)))
            os.replace(whole, path)
    except Exception:  # a full disk, or a program that cannot be written down
        return
