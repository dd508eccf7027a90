"""Tables of known distances (CSV), and their readings from recordings."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.errors import InputError, unknown_name

if TYPE_CHECKING:
    from mocap_jax.calibration import KnownDistance
    from mocap_jax.recording import Recording

# Farther than any ultrasonic source is heard [m].
_FARTHEST = 20.0
_NEEDED = ("source", "true_m")
_COLUMNS = (*_NEEDED, "measured_m", "receiver", "recording", "start_s", "end_s")


def known_distances(
    path: str | os.PathLike[str], recordings: dict[str, Recording]
) -> list[KnownDistance]:
    """Read a table of known distances.

    Args:
        path: CSV file; its columns are described by `mocap-jax calibrate offsets --help`.
        recordings: by path, for lines without a reading of their own.

    Raises:
        InputError: missing or wrong file, column, number, source, receiver or recording; the line
            is named.
    """
    rows = _rows(path)
    if "measured_m" in rows[0][1]:
        return _grouped(path, rows)
    if not recordings:
        raise InputError(f"{path}: has no column 'measured_m'; name the recordings to read from")
    if "receiver" not in rows[0][1]:
        raise InputError(f"{path}: has no column 'receiver'; columns: {', '.join(_COLUMNS)}")
    return [_from_recording(f"{path}: line {line}", row, recordings) for line, row in rows]


def _rows(path: str | os.PathLike[str]) -> list[tuple[int, dict[str, str]]]:
    """Lines with their numbers in the file; blanks and empty lines do not matter."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file, so not CSV") from error
    reader = csv.reader(text.splitlines())
    entries = ((reader.line_num, [x.strip() for x in row]) for row in reader)
    lines = [(number, row) for number, row in entries if any(row)]
    heading = lines[0][1] if lines else []
    for name in heading:
        if name not in _COLUMNS:
            raise InputError(f"{path}: {unknown_name('column', name, _COLUMNS)}")
    for name in _NEEDED:
        if name not in heading:
            raise InputError(f"{path}: has no column '{name}'; columns: {', '.join(_COLUMNS)}")
    rows = []
    for number, row in lines[1:]:
        if len(row) != len(heading):
            raise InputError(
                f"{path}: line {number} has {len(row)} entries, the heading {len(heading)}"
            )
        rows.append((number, dict(zip(heading, row, strict=True))))
    if not rows:
        raise InputError(f"{path}: has a heading but no distances")
    return rows


def _grouped(
    path: str | os.PathLike[str], rows: list[tuple[int, dict[str, str]]]
) -> list[KnownDistance]:
    """Readings of the table itself; those of one source, receiver and distance belong together.

    A blank one is missing (NaN).
    """
    from mocap_jax.calibration import KnownDistance

    groups: dict[tuple[str, str, float], list[float]] = {}
    for line, row in rows:
        where, text = f"{path}: line {line}", row["measured_m"]
        if not row["source"]:
            raise InputError(f"{where}: names no source")
        key = (row["source"], row.get("receiver", ""), _true(row, where))
        reading = _number(text, where, "measured_m") if text else float("nan")
        groups.setdefault(key, []).append(reading)
    return [
        KnownDistance(source, true, np.array(readings), receiver)
        for (source, receiver, true), readings in groups.items()
    ]


def _from_recording(
    where: str, row: dict[str, str], recordings: dict[str, Recording]
) -> KnownDistance:
    from mocap_jax.calibration import KnownDistance, pair_readings

    path = _recording_of(where, row, recordings)
    start, end = (
        _number(row[key], where, key) if row.get(key) else default
        for key, default in (("start_s", -np.inf), ("end_s", np.inf))
    )
    try:
        readings = pair_readings(recordings[path], row["source"], row["receiver"], (start, end))
    except InputError as error:
        raise InputError(f"{where}: {path}: {error}") from error
    if not readings.size:
        raise InputError(
            f"{where}: {path} has no reading of source '{row['source']}' by '{row['receiver']}'"
            + (f" from {start:g} to {end:g} s" if np.isfinite([start, end]).any() else "")
        )
    source = row["source"]
    if source not in recordings[path].ranges.source_names:  # type: ignore[union-attr]
        source = SOURCE_PREFIX + source
    return KnownDistance(source, _true(row, where), readings, row["receiver"])


def _recording_of(where: str, row: dict[str, str], recordings: dict[str, Recording]) -> str:
    """Path of the recording that a line speaks of."""
    name = row.get("recording", "")
    if not name:
        if len(recordings) == 1:
            return next(iter(recordings))
        raise InputError(f"{where}: names no recording; valid: {', '.join(recordings)}")
    matches = [p for p in recordings if p == name or Path(p).name == name]
    if len(matches) != 1:
        raise InputError(f"{where}: {unknown_name('recording', name, recordings)}")
    return matches[0]


def _true(row: dict[str, str], where: str) -> float:
    value = _number(row["true_m"], where, "true_m")
    if not value > 0:
        raise InputError(f"{where}: source '{row['source']}': true_m {value:g} is not above zero")
    if value > _FARTHEST:
        raise InputError(
            f"{where}: true_m {value:g}: probably millimetres; expected metres (at most "
            f"{_FARTHEST:g})"
        )
    return value


def _number(text: str, where: str, column: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(f"{where}: {column} '{text}' is not a number")
    return value
