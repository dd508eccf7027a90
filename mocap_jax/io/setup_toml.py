"""`Setup` as TOML: the attachment `setup.toml` (schema in docs/setup_toml.md)."""

from __future__ import annotations

import dataclasses
import os
import tomllib
from pathlib import Path
from typing import Any

import tomli_w

from mocap_jax.errors import InputError
from mocap_jax.io.atomic import atomic_file
from mocap_jax.io.calibration_toml import calibration_from_table, calibration_to_table
from mocap_jax.io.toml_values import known_keys, number, setup_text, sub_table
from mocap_jax.recording import NoiseFigures, RestHold, SensorSpec, Setup

SETUP_KEYS = (
    "pulse_interval", "speed_of_sound", "score_from", "sources", "noise", "rest", "sensors",
    "calibration", "provenance",
)  # fmt: skip
_SENSOR_KEYS = ("name", "site", "rate_hz")
_REST_KEYS = ("start", "end", "pose")


def setup_to_toml(setup: Setup) -> str:
    """Write a set-up as TOML text."""
    table: dict[str, Any] = {
        "pulse_interval": float(setup.pulse_interval),
        "speed_of_sound": float(setup.speed_of_sound),
        "score_from": float(setup.score_from),
        "sources": list(setup.sources),
        "noise": {k: float(v) for k, v in dataclasses.asdict(setup.noise).items()},
    }
    if setup.rest is not None:
        pose = {joint: [float(x) for x in q] for joint, q in setup.rest.pose.items()}
        table["rest"] = {
            "start": float(setup.rest.start), "end": float(setup.rest.end), "pose": pose,
        }  # fmt: skip
    table["sensors"] = [
        {"name": s.name, "site": s.site, "rate_hz": float(s.rate_hz)} for s in setup.sensors
    ]
    calibration = calibration_to_table(setup.calibration)
    if calibration:
        table["calibration"] = calibration
    if setup.provenance:
        table["provenance"] = {k: _plain(v) for k, v in setup.provenance.items()}
    return tomli_w.dumps(table)


def _plain(value: Any) -> str | float | int | bool:
    """A fact as TOML holds it; NumPy scalars become Python's."""
    item = getattr(value, "item", None)
    value = item() if callable(item) else value
    return value if isinstance(value, str | float | int | bool) else str(value)


def setup_from_toml(text: str, name: str = "setup.toml") -> Setup:
    """Read a set-up from TOML text.

    Args:
        text: the TOML.
        name: what to call it in error messages.

    Raises:
        InputError: not TOML, an unknown key (the valid ones are listed), a missing one, or a
            value of the wrong type or sign.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}: not valid TOML: {error}") from error
    known_keys(table, SETUP_KEYS, name, "")
    default = Setup()
    positive = lambda key, value: number(table.get(key, value), name, key, above=0.0)  # noqa: E731
    sources = table.get("sources", [])
    if not isinstance(sources, list) or not all(isinstance(s, str) for s in sources):
        raise InputError(f"{name}: 'sources' must be a list of site names")
    return Setup(
        sensors=_sensors(table.get("sensors", []), name),
        sources=tuple(sources),
        pulse_interval=positive("pulse_interval", default.pulse_interval),
        speed_of_sound=positive("speed_of_sound", default.speed_of_sound),
        noise=NoiseFigures(**noise_from_table(sub_table(table, "noise", name), name)),
        rest=_rest(sub_table(table, "rest", name), name) if "rest" in table else None,
        score_from=number(table.get("score_from", default.score_from), name, "score_from"),
        calibration=calibration_from_table(sub_table(table, "calibration", name), name),
        provenance=_provenance(sub_table(table, "provenance", name), name),
    )


def read_setup(path: str | os.PathLike[str]) -> Setup:
    """Read a set-up from a TOML file.

    Raises:
        InputError: the file is missing or wrong (see `setup_from_toml`).
    """
    return setup_from_toml(setup_text(path), str(path))


def write_setup(path: str | os.PathLike[str], setup: Setup) -> None:
    """Write a set-up to a TOML file, whole or not at all."""
    with atomic_file(path) as stream:
        stream.write(setup_to_toml(setup).encode())


def noise_from_table(table: dict[str, Any], name: str) -> dict[str, float]:
    """The figures that `[noise]` names.

    Raises:
        InputError: unknown or wrong ones.
    """
    known_keys(table, [f.name for f in dataclasses.fields(NoiseFigures)], name, "noise")
    return {key: number(value, name, f"noise.{key}", above=0.0) for key, value in table.items()}


def _sensors(entries: Any, name: str) -> tuple[SensorSpec, ...]:
    if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
        raise InputError(f"{name}: 'sensors' must be an array of tables ([[sensors]])")
    sensors = tuple(_sensor(entry, i, name) for i, entry in enumerate(entries))
    names = [s.name for s in sensors]
    for sensor in names:
        if names.count(sensor) > 1:
            raise InputError(f"{name}: sensor '{sensor}' is listed {names.count(sensor)} times")
    return sensors


def _sensor(entry: dict[str, Any], index: int, name: str) -> SensorSpec:
    where = f"sensors[{index}]"
    known_keys(entry, _SENSOR_KEYS, name, where)
    for key in ("name", "rate_hz"):
        if key not in entry:
            raise InputError(f"{name}: {where} lacks '{key}' (keys: {', '.join(_SENSOR_KEYS)})")
    sensor, site = entry["name"], entry.get("site", entry["name"])
    if not isinstance(sensor, str) or not isinstance(site, str) or not sensor:
        raise InputError(f"{name}: {where}: 'name' and 'site' must be text")
    return SensorSpec(sensor, site, number(entry["rate_hz"], name, f"{where}.rate_hz", above=0.0))


def _rest(table: dict[str, Any], name: str) -> RestHold:
    known_keys(table, _REST_KEYS, name, "rest")
    for key in ("start", "end"):
        if key not in table:
            raise InputError(f"{name}: [rest] lacks '{key}' (keys: {', '.join(_REST_KEYS)})")
    start = number(table["start"], name, "rest.start")
    end = number(table["end"], name, "rest.end")
    if not end > start:
        raise InputError(f"{name}: rest.end ({end:g} s) must be after rest.start ({start:g} s)")
    return RestHold(
        start, end, _pose(sub_table(table, "pose", f"{name}: [rest]"), name, "rest.pose.")
    )


def _pose(table: dict[str, Any], name: str, where: str) -> dict[str, tuple[float, ...]]:
    pose = {}
    for joint, value in table.items():
        values = value if isinstance(value, list) else [value]
        if len(values) not in (1, 4, 7):
            raise InputError(
                f"{name}: {where}{joint} has {len(values)} numbers; a hinge or slide joint has "
                "1, a ball joint 4 (wxyz), a free joint 7 (xyz, wxyz)"
            )
        pose[joint] = tuple(number(v, name, f"{where}{joint}") for v in values)
    return pose


def read_pose(path: str | os.PathLike[str]) -> dict[str, tuple[float, ...]]:
    """Coordinates of joints from a TOML file, as `[rest.pose]` has them: `joint = [numbers]`.

    Raises:
        InputError: the file is missing, not TOML, or has a joint with wrong numbers.
    """
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(
            f"{path}: no such pose file; valid: reference, declared, or a TOML file of joints"
        ) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error
    return _pose(table, str(path), "")


def _provenance(table: dict[str, Any], name: str) -> dict[str, str | float | int | bool]:
    for key, value in table.items():
        if not isinstance(value, str | float | int | bool):
            raise InputError(f"{name}: provenance.{key} must be text, a number or true/false")
    return table
