"""MATLAB files (v5 and v7.3) with a mapping of their variables (`columns.py`) or a preset."""

from __future__ import annotations

import re
from collections.abc import Mapping as Dictionary
from pathlib import Path
from typing import Any

import numpy as np

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io.convert.clock import increasing, nominal_rate
from mocap_jax.io.convert.columns import (
    TIME_UNITS,
    ColumnMapping,
    SensorColumns,
    presets,
    read_column_mapping,
)
from mocap_jax.io.convert.convention import Convention, quaternions_of_matrices
from mocap_jax.io.convert.paths import files_of, one_file
from mocap_jax.io.convert.plain_csv import WIDTHS, convention_of
from mocap_jax.io.convert.source import ReadOptions, RootSamples, SensorSamples, Source

NAME = "mat"
SUMMARY = "MATLAB file with a mapping of its variables, or a preset"
CONVENTION = Convention()
_COLUMNS = re.compile(r"(?P<path>[^\[]+)(\[(?P<first>\d+):(?P<last>\d+)\])?$")


def recognises(paths: list[Path]) -> bool:
    """Whether this is a MATLAB file."""
    return bool(files_of(paths, (".mat",)))


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read a MATLAB file.

    Raises:
        InputError: not a MATLAB file, no mapping and no preset that fits, a missing variable, one
            of another shape.
    """
    file = one_file(paths, (".mat",), "MATLAB file")
    variables = load_variables(file)
    name = options.mapping or _preset_of(file, variables)
    mapping = read_column_mapping(name, NAME, str(file))
    sensors = tuple(_sensor(s, mapping, variables, file, options) for s in mapping.sensors)
    shape = [np.shape(_variable(variables, n, file)) for s in mapping.sensors
             for n in s.columns.get("orientation", ())]  # fmt: skip
    return Source(
        NAME, str(file), sensors,
        convention_of(mapping, any(s[-2:] == (3, 3) or s[-1:] == (9,) for s in shape)),
        {"device": mapping.device or "unknown", "mapping": Path(mapping.name).name,
         "sampling_rate_hz": sensors[0].rate_hz,
         "clock": f"variable {mapping.time}" if mapping.time else "even, at the given rate"},
        remarks=(mapping.remark,) if mapping.remark else (),
        root=_root(mapping, variables, file, sensors[0].time),
    )  # fmt: skip


def load_variables(file: Path) -> dict[str, Any]:
    """All variables of a MATLAB file; structures as dictionaries, (n, k) with samples first.

    Raises:
        InputError: missing file, not a MATLAB file, v7.3 without `h5py`.
    """
    from scipy.io import loadmat

    if not file.is_file():
        raise InputError(f"{file}: no such file")
    with open(file, "rb") as stream:
        head = stream.read(128)
    if head[:8] == b"\x89HDF\r\n\x1a\n" or b"MATLAB 7.3" in head:
        return _load_v73(file)
    try:
        content = loadmat(file, simplify_cells=True)
    except Exception as error:  # SciPy raises whatever it stumbles over in a damaged file
        text = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{file}: not a readable MATLAB file: {text}") from error
    return {k: v for k, v in content.items() if not k.startswith("__")}


def _load_v73(file: Path) -> dict[str, Any]:
    from mocap_jax.io.convert.hdf5 import open_hdf5

    with open_hdf5(file) as document:
        return {k: _from_hdf5(v) for k, v in document.items() if not k.startswith("#")}


def _from_hdf5(item: Any) -> Any:
    if hasattr(item, "items"):
        return {k: _from_hdf5(v) for k, v in item.items()}
    value = np.asarray(item)
    # MATLAB stores columns first: HDF5 shows every array transposed.
    return np.squeeze(value.T) if value.ndim else value[()]


def _preset_of(file: Path, variables: dict[str, Any]) -> str | None:
    """The preset all of whose variables exist."""
    for name in presets():
        try:
            mapping = read_column_mapping(name, NAME, str(file))
        except InputError:
            continue
        wanted = [n for s in mapping.sensors for names in s.columns.values() for n in names]
        if all(_has(variables, n) for n in wanted):
            return name
    return None


def _has(variables: dict[str, Any], name: str) -> bool:
    try:
        _variable(variables, name, Path())
    except InputError:
        return False
    return True


def _variable(variables: dict[str, Any], name: str, file: Path) -> Any:
    """A variable by its path `a.b.c[first:last]`."""
    match = _COLUMNS.match(name)
    if match is None:
        raise InputError(f"{file}: '{name}' is not a variable; write it as a.b or a.b[0:3]")
    value: Any = variables
    done = ""
    for part in match["path"].split("."):
        if not isinstance(value, Dictionary) or part not in value:
            valid = list(value) if isinstance(value, Dictionary) else []
            what = f"variable in '{done}'" if done else "variable"
            raise InputError(f"{file}: {unknown_name(what, part, valid)}")
        value, done = value[part], f"{done}.{part}" if done else part
    if match["first"] is not None:
        value = np.asarray(value)[:, int(match["first"]) : int(match["last"])]
    return value


def _array(variables: dict[str, Any], names: list[str], file: Path) -> np.ndarray:
    parts = []
    for name in names:
        try:
            value = np.asarray(_variable(variables, name, file), float)
        except (TypeError, ValueError) as error:
            raise InputError(f"{file}: variable '{name}' is not numbers") from error
        parts.append(value if len(names) == 1 else value.reshape(len(value), -1))
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)


def _sensor(
    sensor: SensorColumns,
    mapping: ColumnMapping,
    variables: dict[str, Any],
    file: Path,
    options: ReadOptions,
) -> SensorSamples:
    values: dict[str, np.ndarray] = {}
    for kind, names in sensor.columns.items():
        values[kind] = _shaped(_array(variables, names, file), kind, names, file)
    lengths = {k: len(v) for k, v in values.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"{file}: {sensor.worn.name}: variables differ in length: {lengths}")
    count = next(iter(lengths.values()))
    time, rate = _time(sensor.time or mapping.time, count, mapping, variables, file, options)
    return SensorSamples(
        sensor.worn.identity, time, rate, values.get("accelerometer"), values.get("gyroscope"),
        values.get("orientation"), magnetic=values.get("magnetometer"),
    )  # fmt: skip


def _shaped(value: np.ndarray, kind: str, names: list[str], file: Path) -> np.ndarray:
    """(n, width), also from (width, n) and, for matrices, from (n, 3, 3) and (3, 3, n)."""
    if kind == "orientation" and value.ndim == 3:
        value = value if value.shape[1:] == (3, 3) else np.moveaxis(value, -1, 0)
        return quaternions_of_matrices(value.reshape(-1, 3, 3), f"{file}: {names[0]}")
    if value.ndim == 2 and value.shape[1] not in WIDTHS[kind] and value.shape[0] in WIDTHS[kind]:
        value = value.T
    if value.ndim != 2 or value.shape[1] not in WIDTHS[kind]:
        wanted = " or ".join(f"(n, {w})" for w in WIDTHS[kind])
        raise InputError(
            f"{file}: {', '.join(names)} has shape {value.shape}, expected {wanted} for {kind}"
        )
    if value.shape[1] == 9:
        return quaternions_of_matrices(value.reshape(-1, 3, 3), f"{file}: {names[0]}")
    return value


def _time(
    name: str | None,
    count: int,
    mapping: ColumnMapping,
    variables: dict[str, Any],
    file: Path,
    options: ReadOptions,
) -> tuple[np.ndarray, float]:
    given = options.rate_hz
    if given is None and mapping.rate_hz is not None:
        rate = mapping.rate_hz
        given = float(_variable(variables, rate, file)) if isinstance(rate, str) else rate
    if name is not None:
        seconds = np.ravel(_array(variables, [name], file)) * TIME_UNITS[mapping.time_unit]
        if len(seconds) != count:
            raise InputError(f"{file}: '{name}' has {len(seconds)} times for {count} samples")
        return increasing(seconds, f"{file}: {name}"), nominal_rate(seconds, given, str(file))
    if given is None:
        raise InputError(f"{mapping.name}: says neither time nor rate_hz; give the rate (--rate)")
    return np.arange(count) / given, given


def _root(
    mapping: ColumnMapping, variables: dict[str, Any], file: Path, time: np.ndarray
) -> RootSamples | None:
    if not mapping.root:
        return None
    position = _array(variables, mapping.root["position"], file)
    orientation = _array(variables, mapping.root["orientation"], file)
    if position.shape != (len(time), 3) or orientation.shape != (len(time), 4):
        raise InputError(f"{file}: root position and orientation must be (n, 3) and (n, 4)")
    return RootSamples(time, position, orientation, mapping.root_is_truth)
