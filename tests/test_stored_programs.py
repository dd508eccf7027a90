"""Programs are found on disk without tracing, and only where they are the same program."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np
import pytest
from jax.experimental.compilation_cache import compilation_cache

import mocap_jax as mj
from mocap_jax import program_key
from mocap_jax.body import load_body
from mocap_jax.estimate.compile_clock import CompileClock
from mocap_jax.stored_programs import StoredProgram, forget_programs


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    names = "jax_compilation_cache_dir", "jax_persistent_cache_min_compile_time_secs"
    before = [getattr(jax.config, n) for n in names]
    compilation_cache.reset_cache()
    for name, value in zip(names, (str(tmp_path), 0.1), strict=True):
        jax.config.update(name, value)
    yield tmp_path
    for name, value in zip(names, before, strict=True):
        jax.config.update(name, value)
    compilation_cache.reset_cache()


def counted(traces: list[int]) -> Callable:
    def product(a: jax.Array, b: dict[str, jax.Array], power: object) -> dict[str, jax.Array]:
        traces.append(1)
        return {"product": a @ b["x"] ** (power if isinstance(power, int) else 1)}

    return product


A, B = np.arange(6.0).reshape(2, 3), {"x": np.arange(12.0).reshape(3, 4)}


def kept(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.program"))


def test_another_process_would_not_trace(folder: Path) -> None:
    traces: list[int] = []
    first, second = (StoredProgram(counted(traces), static=("power",)) for _ in range(2))
    expected = A @ B["x"] ** 2
    for program in (first, first, second):
        np.testing.assert_allclose(program(A, B, 2)["product"], expected, rtol=1e-14)
    assert len(traces) == 1
    assert len(kept(folder)) == 1


@pytest.mark.parametrize(
    "arguments",
    [(A, B, 3), (A[:1], B, 2), (A, {"x": B["x"].astype(np.float32)}, 2), (A, B | {"y": A}, 2)],
    ids=["static", "shape", "type", "structure"],
)
def test_other_arguments_are_other_programs(folder: Path, arguments: tuple) -> None:
    program = StoredProgram(counted([]), static=("power",))
    program(A, B, 2)
    program(*arguments)
    assert len(kept(folder)) == 2


@pytest.mark.parametrize(
    ("what", "executables"), [("source", 1), ("surroundings", 2)], ids=["source", "surroundings"]
)
def test_what_changed_is_traced_anew(
    folder: Path, monkeypatch, what: str, executables: int
) -> None:
    """Other source may ask for the same executable; other libraries never do."""
    traces: list[int] = []
    StoredProgram(counted(traces), static=("power",))(A, B, 2)
    monkeypatch.setattr(program_key, what, lambda: ("changed",))
    for _ in range(2):
        StoredProgram(counted(traces), static=("power",))(A, B, 2)
    assert len(traces) == 2
    assert len(kept(folder)) == 2
    assert len(list(folder.glob("*.executable"))) == executables


def test_what_jax_had_on_disk_is_compiled_again(folder: Path) -> None:
    """A loaded executable lacks functions when it is written and loaded again."""
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    StoredProgram(counted([]), static=("power",))._jitted.lower(A, B, 2).compile()
    jax.clear_caches()
    traces: list[int] = []
    for _ in range(2):
        out = StoredProgram(counted(traces), static=("power",))(A, B, 2)
        np.testing.assert_allclose(out["product"], A @ B["x"] ** 2, rtol=1e-14)
    assert len(traces) == 1
    assert len(list(folder.glob("*.executable"))) == 1
    assert jax.config.jax_enable_compilation_cache


@pytest.mark.parametrize("suffix", ["program", "executable"])
@pytest.mark.parametrize("damage", [b"", b"no program", "half"])
def test_damaged_files_are_replaced(folder: Path, damage: bytes | str, suffix: str) -> None:
    traces: list[int] = []
    StoredProgram(counted(traces), static=("power",))(A, B, 2)
    (path,) = folder.glob(f"*.{suffix}")
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] if isinstance(damage, str) else damage)
    out = StoredProgram(counted(traces), static=("power",))(A, B, 2)
    np.testing.assert_allclose(out["product"], A @ B["x"] ** 2, rtol=1e-14)
    assert len(traces) == 2
    assert len(path.read_bytes()) > len(whole) // 2


def test_arguments_that_are_not_used_count(folder: Path) -> None:
    """They leave no trace in the program, but executables check the shapes of all arguments."""

    def doubled(a: jax.Array, unused: jax.Array) -> jax.Array:
        return 2 * a

    for shape in ((4, 0), (0, 0), (4, 0)):
        out = StoredProgram(doubled)(A, np.zeros(shape))
        np.testing.assert_allclose(out, 2 * A)


def test_without_a_folder_programs_stay_in_memory(folder: Path) -> None:
    jax.config.update("jax_compilation_cache_dir", None)
    traces: list[int] = []
    program = StoredProgram(counted(traces), static=("power",))
    program(A, B, 2), program(A, B, 2)
    assert len(traces) == 1
    assert not kept(folder)


def squared(x: object) -> None:
    """Stands for a user's function, whose source is not known."""


class Settings(NamedTuple):
    """Stands for a user's class."""

    value: int = 1


@pytest.mark.parametrize(
    "value", [lambda: None, squared, Settings(), functools.partial(squared, 2), Settings]
)
def test_what_users_wrote_is_not_known_by_its_name(folder: Path, value: object) -> None:
    """Its source may change from one process to the next."""
    program = StoredProgram(counted([]), static=("power",))
    np.testing.assert_allclose(program(A, B, value)["product"], A @ B["x"], rtol=1e-14)
    assert not kept(folder)


def test_what_the_package_wrote_is_known(folder: Path) -> None:
    program = StoredProgram(counted([]), static=("power",))
    program(A, B, (load_body, mj.OptimiseOptions(), np.float32, functools.partial(load_body)))
    assert len(kept(folder)) == 1


def test_preparing_tells_the_result(folder: Path) -> None:
    traces: list[int] = []
    shapes = [jax.ShapeDtypeStruct(x.shape, x.dtype) for x in (A, B["x"])]
    for _ in range(2):
        program = StoredProgram(counted(traces), static=("power",))
        result = program.prepare(shapes[0], {"x": shapes[1]}, 2)
        assert result["product"].shape == (2, 4)
        program(A, B, 2)
    assert len(traces) == 1


def test_settings_of_jax_make_other_programs(folder: Path) -> None:
    program = StoredProgram(counted([]), static=("power",))
    wide = program(A, B, 2)["product"]
    with jax.enable_x64(False):
        narrow = program(A, B, 2)["product"]
    assert (wide.dtype, narrow.dtype) == (np.float64, np.float32)
    with jax.default_matmul_precision("highest"):
        program(A, B, 2)
    assert len(kept(folder)) == 3


def test_jax_can_switch_the_folder_off(folder: Path) -> None:
    jax.config.update("jax_enable_compilation_cache", False)
    try:
        StoredProgram(counted([]), static=("power",))(A, B, 2)
    finally:
        jax.config.update("jax_enable_compilation_cache", True)
    assert not kept(folder)


def test_files_long_unused_go(folder: Path) -> None:
    old = folder / "solve-0.executable"
    old.touch()
    os.utime(old, (0, 0))
    StoredProgram(counted([]), static=("power",))(A, B, 2)
    assert not old.exists()


def test_a_folder_may_move(folder: Path, tmp_path_factory) -> None:
    traces: list[int] = []
    StoredProgram(counted(traces), static=("power",))(A, B, 2)
    moved = tmp_path_factory.mktemp("elsewhere")
    for file in (*folder.glob("*.program"), *folder.glob("*.executable")):
        file.rename(moved / file.name)
    jax.config.update("jax_compilation_cache_dir", str(moved))
    StoredProgram(counted(traces), static=("power",))(A, B, 2)
    assert len(traces) == 1


def test_loading_counts_as_compilation(folder: Path) -> None:
    clock = CompileClock()
    StoredProgram(counted([]), static=("power",))(A, B, 2)
    with clock:
        StoredProgram(counted([]), static=("power",))(A, B, 2)
    assert clock.seconds > 0


_LAPACK = """
import jax, numpy as np
from mocap_jax.body import load_body
from mocap_jax.estimate.compile_clock import CompileClock
from mocap_jax.stored_programs import StoredProgram
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_compilation_cache_dir", {folder!r})
def solve(a, b):
    print("traced")
    return jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(a), b)
print(np.asarray(StoredProgram(solve)(2 * np.eye(3), np.ones(3))))
"""


def test_a_new_process_loads_what_calls_lapack(tmp_path: Path) -> None:
    """JAX looks for LAPACK when it lowers; a program loaded before that would crash."""
    command = [sys.executable, "-c", _LAPACK.format(folder=str(tmp_path))]
    out = [
        subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ).stdout
        for _ in range(2)
    ]
    assert out == ["traced\n[0.5 0.5 0.5]\n", "[0.5 0.5 0.5]\n"]


def test_a_machine_with_two_devices_runs_on_one(tmp_path: Path) -> None:
    flags = os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=2"}
    command = [sys.executable, "-c", _LAPACK.format(folder=str(tmp_path))]
    out = [
        subprocess.run(command, check=True, capture_output=True, text=True, env=flags).stdout
        for _ in range(2)
    ]
    assert out == ["traced\n[0.5 0.5 0.5]\n", "[0.5 0.5 0.5]\n"]


def test_forgotten_programs_are_read_again(folder: Path) -> None:
    traced: list[int] = []

    def double(x: jax.Array) -> jax.Array:
        traced.append(1)
        return 2 * x

    program = StoredProgram(double)
    for _ in range(2):
        assert program(np.ones(3)).sum() == 6.0
    assert len(program._loaded) == 1
    forget_programs()
    assert not program._loaded
    assert program(np.ones(3)).sum() == 6.0
    assert len(traced) == 1 and list(folder.iterdir())
