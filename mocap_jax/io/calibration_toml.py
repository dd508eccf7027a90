"""`Calibration` as the table `[calibration]` of a set-up (schema in docs/setup_toml.md)."""

from __future__ import annotations

from typing import Any

from mocap_jax.errors import InputError
from mocap_jax.io.toml_values import known_keys, number, sub_table, triple
from mocap_jax.recording import AxisCalibration, AxisNoise, Calibration, SourceOffset

_AXES = ("zero", "slope", "zero_sigma", "slope_sigma")
_NOISE = ("white", "instability", "random_walk")
_OFFSET = ("offset", "sigma")
_KINDS = {
    "accelerometer": _AXES, "gyroscope": _AXES, "source_offset": _OFFSET,
    "accelerometer_noise": _NOISE, "gyroscope_noise": _NOISE,
}  # fmt: skip


def calibration_to_table(calibration: Calibration) -> dict[str, Any]:
    """The table; empty where nothing is calibrated."""
    table: dict[str, Any] = {}
    for kind, keys in _KINDS.items():
        entries = {
            name: {key: _plain(getattr(figures, key)) for key in keys}
            for name, figures in getattr(calibration, kind).items()
        }
        if entries:
            table[kind] = entries
    return {"applied": True, **table} if calibration.applied else table


def _plain(value: Any) -> float | list[float]:
    return [float(x) for x in value] if isinstance(value, tuple) else float(value)


def calibration_from_table(table: dict[str, Any], name: str) -> Calibration:
    """Read the table.

    Args:
        table: `[calibration]`.
        name: what to call the file in error messages.

    Raises:
        InputError: an unknown key, a missing one, or a value of the wrong type or sign.
    """
    known_keys(table, (*_KINDS, "applied"), name, "calibration")
    applied = table.get("applied", False)
    if not isinstance(applied, bool):
        raise InputError(f"{name}: 'calibration.applied' must be true or false, not {applied!r}")
    entries = {kind: _entries(table, kind, name) for kind in _KINDS}
    axes = {
        kind: {sensor: _axes(e, name, f"calibration.{kind}.{sensor}") for sensor, e in found}
        for kind, found in entries.items()
        if _KINDS[kind] is _AXES
    }
    noise = {
        kind: {sensor: _noise(e, name, f"calibration.{kind}.{sensor}") for sensor, e in found}
        for kind, found in entries.items()
        if _KINDS[kind] is _NOISE
    }
    offsets = {
        source: _offset(e, name, f"calibration.source_offset.{source}")
        for source, e in entries["source_offset"]
    }
    return Calibration(**axes, **noise, source_offset=offsets, applied=applied)


def _entries(table: dict[str, Any], kind: str, name: str) -> list[tuple[str, dict[str, Any]]]:
    """Figures by sensor or source, their keys checked."""
    found = sub_table(table, kind, f"{name}: [calibration]")
    for sensor, entry in found.items():
        if not isinstance(entry, dict):
            raise InputError(f"{name}: 'calibration.{kind}.{sensor}' must be a table")
        known_keys(entry, _KINDS[kind], name, f"calibration.{kind}.{sensor}")
    return list(found.items())


def _axes(entry: dict[str, Any], name: str, where: str) -> AxisCalibration:
    signs = {"slope": 0.0}
    return AxisCalibration(
        **{key: triple(v, name, f"{where}.{key}", signs.get(key)) for key, v in entry.items()}
    )


def _noise(entry: dict[str, Any], name: str, where: str) -> AxisNoise:
    if "white" not in entry:
        raise InputError(f"{name}: [{where}] lacks 'white' (keys: {', '.join(_NOISE)})")
    return AxisNoise(**{key: triple(v, name, f"{where}.{key}") for key, v in entry.items()})


def _offset(entry: dict[str, Any], name: str, where: str) -> SourceOffset:
    if "offset" not in entry:
        raise InputError(f"{name}: [{where}] lacks 'offset' (keys: {', '.join(_OFFSET)})")
    return SourceOffset(**{key: number(v, name, f"{where}.{key}") for key, v in entry.items()})
