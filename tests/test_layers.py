"""Imports point one way: a room of the package uses only rooms of lower layers."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "mocap_jax"

LAYERS: tuple[tuple[str, ...], ...] = (
    ("errors", "so3", "compilation_cache"),
    ("linalg", "program_key"),
    ("stored_programs",),
    ("body",),
    ("trajectory",),
    ("recording",),
    ("solution",),
    ("least_squares", "kalman", "motion"),
    ("io", "measurement", "metrics", "signals"),
    ("residuals", "simulation", "pose_prior", "decoding"),
    ("initialise",),
    ("estimate", "conversion", "calibration"),
    ("placement", "arm"),
    ("report", "batch"),
    ("view",),
    ("cli",),
)
LAYER_OF = {room: layer for layer, rooms in enumerate(LAYERS) for room in rooms}
MUJOCO_ROOMS = {"body", "motion", "simulation", "report"}
KNOW_NO_BODIES = {"least_squares", "kalman", "linalg"}


def source_files() -> list[Path]:
    return sorted(p for p in PACKAGE.rglob("*.py") if p != PACKAGE / "__init__.py")


def room_of(file: Path) -> str:
    return file.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_modules(file: Path) -> set[str]:
    """Absolute names of all modules a file imports, anywhere in it."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import on line {node.lineno}"
            if node.module == "mocap_jax":
                modules |= {f"mocap_jax.{alias.name}" for alias in node.names}
            elif node.module:
                modules.add(node.module)
    return modules


def imported_rooms(file: Path) -> set[str]:
    """Rooms of the package a file imports (names of the top level as they are)."""
    own = {m.split(".")[1] for m in imported_modules(file) if m.startswith("mocap_jax.")}
    return own - {"__version__"}


def test_every_room_has_a_layer():
    rooms = {room_of(f) for f in source_files()}
    assert rooms <= set(LAYER_OF), f"give these a layer: {sorted(rooms - set(LAYER_OF))}"


@pytest.mark.parametrize("room", LAYER_OF)
def test_room_imports_only_lower_layers(room: str):
    wrong = []
    for file in (f for f in source_files() if room_of(f) == room):
        for other in imported_rooms(file) - {room}:
            if LAYER_OF.get(other, len(LAYERS)) >= LAYER_OF[room]:
                wrong.append(f"{file.relative_to(PACKAGE)} imports {other}")
    assert not wrong, "\n".join(wrong)


def test_mujoco_only_where_bodies_are_compiled_simulated_or_drawn():
    users = {
        room_of(f)
        for f in source_files()
        for module in imported_modules(f)
        if module.split(".")[0] == "mujoco"
    }
    assert users <= MUJOCO_ROOMS, f"MuJoCo is imported in {sorted(users - MUJOCO_ROOMS)}"


def test_solvers_know_no_bodies():
    for file in (f for f in source_files() if room_of(f) in KNOW_NO_BODIES):
        assert not imported_rooms(file) & {"body", "recording", "solution", "motion"}, file


def test_simulator_shares_no_physics_with_the_estimators():
    for file in (f for f in source_files() if room_of(f) == "simulation"):
        forbidden = {"measurement", "residuals", "kalman", "estimate", "initialise"}
        assert not imported_rooms(file) & forbidden, file


def test_nothing_imports_tests_or_itself_by_the_public_names():
    for file in source_files():
        assert "mocap_jax" not in imported_modules(file), f"{file}: import the room instead"
