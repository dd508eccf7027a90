"""Plain CSV files of any origin, with a mapping that says what the columns are (`columns.py`)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io.convert.clock import increasing, nominal_rate
from mocap_jax.io.convert.columns import (
    TIME_UNITS,
    ColumnMapping,
    SensorColumns,
    read_column_mapping,
)
from mocap_jax.io.convert.convention import Convention, quaternions_of_matrices
from mocap_jax.io.convert.paths import files_of
from mocap_jax.io.convert.source import ReadOptions, RootSamples, SensorSamples, Source
from mocap_jax.io.convert.text_table import TextTable, holds_numbers, read_table, unnamed

NAME = "csv"
SUMMARY = "plain CSV with a mapping of its columns"
CONVENTION = Convention()
_SUFFIXES = (".csv", ".txt", ".tsv", ".dat")
WIDTHS = {"accelerometer": (3,), "gyroscope": (3,), "magnetometer": (3,), "orientation": (4, 9)}
"""Columns of each kind; orientations are quaternions or matrices, row by row."""


def recognises(paths: list[Path]) -> bool:
    """Whether these are text tables (asked after all other formats)."""
    return bool(files_of(paths, _SUFFIXES))


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read one or several tables.

    Raises:
        InputError: no mapping, a missing file or column, a wrong table, time that runs backwards.
    """
    mapping = read_column_mapping(options.mapping, NAME, str(paths[0]))
    files = {f.name: f for f in files_of(paths, _SUFFIXES)}
    if not files:
        raise InputError(f"{paths[0]}: no tables there (suffix {', '.join(_SUFFIXES)})")
    tables: dict[str, TextTable] = {}
    sensors = tuple(_sensor(s, mapping, files, tables, options) for s in mapping.sensors)
    matrices = any(len(s.columns.get("orientation", ())) == 9 for s in mapping.sensors)
    return Source(
        NAME, str(paths[0]), sensors, convention_of(mapping, matrices),
        {"device": mapping.device or "unknown", "mapping": Path(mapping.name).name,
         "sampling_rate_hz": sensors[0].rate_hz,
         "clock": f"column {mapping.time}" if mapping.time else "even, at the given rate"},
        tuple(text for t in tables.values() for text in t.salvage),
        (mapping.remark,) if mapping.remark else (),
        root=_root(mapping, files, tables, options),
    )  # fmt: skip


def convention_of(mapping: ColumnMapping, matrices: bool) -> Convention:
    """The mapping's, without a quaternion order where it names matrices."""
    if not matrices:
        return mapping.convention
    return Convention(**{**mapping.convention.__dict__, "quaternion_order": None})


def _sensor(
    sensor: SensorColumns,
    mapping: ColumnMapping,
    files: dict[str, Path],
    tables: dict[str, TextTable],
    options: ReadOptions,
) -> SensorSamples:
    table = _table(sensor.file, mapping, files, tables)
    time, rate = _time(sensor.time or mapping.time, table, mapping, options)
    values = {}
    for kind, names in sensor.columns.items():
        if len(names) not in WIDTHS[kind]:
            wanted = " or ".join(map(str, WIDTHS[kind]))
            raise InputError(
                f"{mapping.name}: {sensor.worn.name}: {kind} has {len(names)} columns, "
                f"expected {wanted}"
            )
        values[kind] = table.columns(names)
        if len(names) == 9:
            matrices = values[kind].reshape(-1, 3, 3)
            values[kind] = quaternions_of_matrices(matrices, str(table.path))
    return SensorSamples(
        sensor.worn.identity, time, rate, values.get("accelerometer"), values.get("gyroscope"),
        values.get("orientation"), magnetic=values.get("magnetometer"),
    )  # fmt: skip


def _table(
    name: str | None, mapping: ColumnMapping, files: dict[str, Path], tables: dict[str, TextTable]
) -> TextTable:
    if name is None:
        if len(files) > 1:
            raise InputError(
                f"{mapping.name}: there are {len(files)} tables; say which sensor is in which "
                f"(file = ...); valid: {', '.join(files)}"
            )
        name = next(iter(files))
    if name not in files:
        raise InputError(f"{mapping.name}: {unknown_name('file', name, files)}")
    if name not in tables:
        table = read_table(files[name], delimiter=mapping.delimiter, named=mapping.header)
        _check_header(table, mapping)
        tables[name] = table
    return tables[name]


def _check_header(table: TextTable, mapping: ColumnMapping) -> None:
    """Say of a table without a header how to call its columns."""
    wanted = {c for s in mapping.sensors for names in s.columns.values() for c in names}
    if mapping.header and holds_numbers(table.names) and wanted.isdisjoint(table.names):
        raise unnamed(table.path)


def _time(
    column: str | None, table: TextTable, mapping: ColumnMapping, options: ReadOptions
) -> tuple[np.ndarray, float]:
    given = options.rate_hz
    if given is None and isinstance(mapping.rate_hz, float):
        given = mapping.rate_hz
    if column is not None:
        seconds = table.column(column) * TIME_UNITS[mapping.time_unit]
        time = increasing(seconds, str(table.path), table.first_line)
        return time, nominal_rate(time, given, str(table.path))
    if given is None:
        raise InputError(
            f"{mapping.name}: says neither the time column (time = ...) nor the rate "
            f"(rate_hz = ...); columns: {', '.join(table.names[:24])}"
        )
    return np.arange(len(table.rows)) / given, given


def _root(
    mapping: ColumnMapping,
    files: dict[str, Path],
    tables: dict[str, TextTable],
    options: ReadOptions,
) -> RootSamples | None:
    if not mapping.root:
        return None
    table = _table(mapping.sensors[0].file, mapping, files, tables)
    time, _ = _time(mapping.time, table, mapping, options)
    return RootSamples(
        time,
        table.columns(mapping.root["position"]),
        table.columns(mapping.root["orientation"]),
        mapping.root_is_truth,
    )
