"""`Calibration` as the table `[calibration]` of a set-up (schema in docs/setup_toml.md)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from mocap_jax.errors import InputError
from mocap_jax.io.toml_values import known_keys, number, sub_table, triple
from mocap_jax.recording import AxisCalibration, AxisNoise, Calibration, SourceOffset

_Figures = TypeVar("_Figures", AxisCalibration, AxisNoise, SourceOffset)

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
    return Calibration(
        accelerometer=_all(table, "accelerometer", name, _axes),
        gyroscope=_all(table, "gyroscope", name, _axes),
        source_offset=_all(table, "source_offset", name, _offset),
        accelerometer_noise=_all(table, "accelerometer_noise", name, _noise),
        gyroscope_noise=_all(table, "gyroscope_noise", name, _noise),
        applied=applied,
    )


def _all(
    table: dict[str, Any],
    kind: str,
    name: str,
    read: Callable[[dict[str, Any], str, str], _Figures],
) -> dict[str, _Figures]:
    """Figures of one kind by sensor or source."""
    found = {}
    for sensor, entry in sub_table(table, kind, f"{name}: [calibration]").items():
        where = f"calibration.{kind}.{sensor}"
        if not isinstance(entry, dict):
            raise InputError(f"{name}: '{where}' must be a table")
        known_keys(entry, _KINDS[kind], name, where)
        found[sensor] = read(entry, name, where)
    return found


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
