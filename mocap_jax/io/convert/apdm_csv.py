"""CSV exports of APDM Opal: a file a sensor, columns named by quantity and axis.

Names are compared without case, spaces and units: `Time` (microseconds since 1970, or seconds),
`Accelerometer X..Z` or `Acc X..Z` [m/s^2], `Gyroscope X..Z` or `Gyr X..Z` [rad/s], `Magnetometer
X..Z` [uT], `Orientation S, X, Y, Z` (scalar first). Other columns are left alone. A file is named
by the sensor: the last part of its stem after `_`.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.io.convert.apdm import CONVENTION as _APDM
from mocap_jax.io.convert.clock import increasing, nominal_rate
from mocap_jax.io.convert.paths import files_of, over
from mocap_jax.io.convert.source import ReadOptions, SensorSamples, Source
from mocap_jax.io.convert.text_table import TextTable, read_table

NAME = "apdm-csv"
SUMMARY = "CSV exports of APDM Opal, a file a sensor"
CONVENTION = _APDM
_KINDS = {
    "accelerometer": ("accelerometer", "accel", "acceleration", "acc"),
    "gyroscope": ("gyroscope", "gyro", "gyr", "angularvelocity"),
    "magnetometer": ("magnetometer", "magnet", "mag"),
    "orientation": ("orientation", "quaternion", "quat"),
}
_SCALAR = ("s", "w", "0", "scalar", "q0")


def recognises(paths: list[Path]) -> bool:
    """Never by itself: any CSV could be one."""
    del paths
    return False


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read the files of one recording.

    Raises:
        InputError: no files, no accelerometer columns, a wrong table.
    """
    files = files_of(paths, (".csv",))
    if not files:
        raise InputError(f"{paths[0]}: no CSV files there")
    read = [(f, read_table(f)) for f in over(files, options.progress)]
    sensors = tuple(_sensor(f, table, options) for f, table in read)
    zero = min(float(s.time[0]) for s in sensors)
    epoch = zero > 1e8  # seconds since 1970 rather than since some start
    return Source(
        NAME, str(paths[0]), sensors, CONVENTION,
        {"device": "APDM Opal", "sampling_rate_hz": sensors[0].rate_hz,
         "clock": "synchronised time stamps of the files"},
        tuple(text for _, table in read for text in table.salvage),
        start_utc_ns=0 if epoch else None,
    )  # fmt: skip


def _plain(name: str) -> str:
    """A column's name without unit, case, spaces and punctuation."""
    return re.sub(r"[^a-z0-9]", "", re.sub(r"[\[(].*", "", name.lower()))


def _sensor(file: Path, table: TextTable, options: ReadOptions) -> SensorSamples:
    time = _time(table)
    values = {kind: _kind(table, kind) for kind in _KINDS}
    if values["accelerometer"] is None:
        raise InputError(
            f"{file}: no columns 'Accelerometer X' to 'Accelerometer Z'; columns: "
            f"{', '.join(table.names[:24])}"
        )
    return SensorSamples(
        file.stem.rpartition("_")[2], time, nominal_rate(time, options.rate_hz, str(file)),
        values["accelerometer"], values["gyroscope"], values["orientation"],
        magnetic=values["magnetometer"],
    )  # fmt: skip


def _time(table: TextTable) -> np.ndarray:
    name = next((n for n in table.names if _plain(n) in ("time", "timestamp")), None)
    if name is None:
        raise InputError(f"{table.path}: no column 'Time'; columns: {', '.join(table.names[:24])}")
    values = table.column(name)
    # Microseconds since 1970 are beyond any count of seconds.
    scale = 1e-6 if np.nanmedian(np.abs(values)) > 1e12 else 1.0
    return increasing(values * scale, str(table.path), table.first_line)


def _kind(table: TextTable, kind: str) -> np.ndarray | None:
    plain = {_plain(n): n for n in table.names}
    for word in _KINDS[kind]:
        axes = [plain.get(word + axis) for axis in "xyz"]
        if not all(axes):
            continue
        if kind != "orientation":
            return table.columns([a for a in axes if a])
        scalar = next((plain[word + s] for s in _SCALAR if word + s in plain), None)
        if scalar is not None:
            return table.columns([scalar, *(a for a in axes if a)])
    return None
