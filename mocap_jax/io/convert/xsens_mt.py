"""Text exports of Xsens MT Manager (MTw, MTi): a file a sensor, aligned by packet counter.

Columns used, whichever exist: `Acc_X..Z` [m/s^2], `Gyr_X..Z` [rad/s], `Mag_X..Z` (normalised),
`Mat[r][c]` or `Quat_q0..q3` (both sensor to world). Without a packet counter `SampleTimeFine`
(10 kHz) is the clock, without both the rows follow each other at the update rate.
"""

from __future__ import annotations

import datetime
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io.convert.clock import (
    COUNTER_SIZE,
    increasing,
    on_one_clock,
    plausible_gaps,
    unwrapped,
    with_gaps,
)
from mocap_jax.io.convert.convention import Convention, quaternions_of_matrices
from mocap_jax.io.convert.paths import files_of, over
from mocap_jax.io.convert.source import ReadOptions, SensorSamples, Source
from mocap_jax.io.convert.text_table import TextTable, read_table

NAME = "xsens-mt"
SUMMARY = "text exports of Xsens MT Manager, a file a sensor"
CONVENTION = Convention(
    magnetometer_unit="a.u.", heading="as the device's filter set it (x axis to magnetic north "
    "unless heading was reset)",
)  # fmt: skip
_FINE_HZ = 1e4
_MATRIX = tuple(f"Mat[{row}][{column}]" for row in (1, 2, 3) for column in (1, 2, 3))
_QUATERNIONS = tuple(f"Quat_q{i}" for i in range(4)), tuple(f"Quat_{c}" for c in "wxyz")
_NOTHING = ("Acc_X", "Gyr_X", _MATRIX[0], _QUATERNIONS[0][0])
_COLUMNS = ("Acc_X..Z", "Gyr_X..Z", "Mag_X..Z", "Mat[1][1]..Mat[3][3]", "Quat_q0..q3")
_SERIAL = re.compile(r"(?P<trial>.*?)[_-]?(?P<serial>[0-9A-Fa-f]{8})$")


class _File(NamedTuple):
    table: TextTable
    serial: str
    facts: dict[str, str]
    """The file's comments."""
    packets: np.ndarray
    """Unwrapped, or row numbers."""
    wraps: bool


def recognises(paths: list[Path]) -> bool:
    """Whether these are such exports."""
    files = files_of(paths, (".txt", ".csv"))
    return bool(files) and any(_looks_right(f) for f in files[:4])


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read the files of one trial.

    Raises:
        InputError: no such files, several trials, unequal update rates, a wrong table.
    """
    files = _of_one_trial(files_of(paths, (".txt", ".csv")), options.trial, paths)
    read = [_read(f, options) for f in over(files, options.progress)]
    rates = {r.facts.get("Update Rate") for r in read}
    if len(rates) > 1:
        raise InputError(f"{paths[0]}: the files differ in update rate: {sorted(map(str, rates))}")
    rate = options.rate_hz or _rate(read[0])
    clocks = on_one_clock([r.packets for r in read], wraps=all(r.wraps for r in read))
    sensors, lost = [], [text for r in read for text in r.table.salvage]
    for file, packets in zip(read, clocks, strict=True):
        sensors.append(_samples(file, packets, rate))
        missing = int(packets[-1] - packets[0]) + 1 - len(packets)
        if missing:
            lost.append(f"{file.table.path.name}: {missing} packets are missing; left as gaps.")
    matrices = all(r.table.has(*_MATRIX) for r in read)
    return Source(
        NAME, str(paths[0]), tuple(sensors),
        Convention(**{**CONVENTION.__dict__, "quaternion_order": None if matrices else "wxyz"}),
        _facts(read, rate, options.rate_hz is not None), tuple(lost),
        start_utc_ns=_start(read, clocks, rate),
    )  # fmt: skip


def _looks_right(file: Path) -> bool:
    try:
        head = file.read_bytes()[:20000].decode("latin-1")
    except OSError:
        return False
    return "PacketCounter" in head or "SampleTimeFine" in head


def _trial_and_serial(file: Path) -> tuple[str, str]:
    match = _SERIAL.match(file.stem)
    return (match["trial"], match["serial"]) if match else ("", file.stem)


def _of_one_trial(files: list[Path], trial: str | None, paths: list[Path]) -> list[Path]:
    # A damaged export among sound ones must not be passed over.
    named = [f for f in files if _SERIAL.match(f.stem)]
    files = [f for f in files if f in named or f in paths or _looks_right(f)]
    if not files:
        raise InputError(f"{paths[0]}: no Xsens MT exports there (text files with a PacketCounter)")
    trials = sorted({_trial_and_serial(f)[0] for f in files})
    if trial is not None:
        chosen = [f for f in files if f.name.startswith(trial)]
        if not chosen:
            raise InputError(f"{paths[0]}: {unknown_name('trial', trial, trials)}")
        return chosen
    if len(trials) > 1:
        raise InputError(
            f"{paths[0]}: holds {len(trials)} trials ({', '.join(trials[:8])}); name one of them "
            "(--trial), or its files"
        )
    return files


def _read(file: Path, options: ReadOptions) -> _File:
    table = read_table(file, comment="//")
    if not any(table.has(name) for name in _NOTHING):
        raise InputError(
            f"{file}: none of the columns {', '.join(_COLUMNS)} holds data; the header names "
            f"{', '.join(table.names[:24])}"
        )
    facts = {}
    for comment in table.comments:
        key, _, value = comment.partition(":")
        if value.strip():
            facts[key.strip()] = value.strip()
    counter, wraps = _counter(table, options, facts)
    plausible_gaps(counter, str(file))
    return _File(table, _trial_and_serial(file)[1], facts, counter, wraps)


def _counter(
    table: TextTable, options: ReadOptions, facts: dict[str, str]
) -> tuple[np.ndarray, bool]:
    where = str(table.path)
    for name in ("PacketCounter", "SampleTimeFine"):
        if not table.has(name):
            continue
        values = table.column(name)
        if (bad := np.flatnonzero(~np.isfinite(values))).size:
            raise InputError(f"{where}: line {table.first_line + bad[0]}: no {name}")
        counter = values.astype(np.int64)
        if name == "PacketCounter":
            return unwrapped(counter, where, table.first_line), bool(counter.max() < COUNTER_SIZE)
        seconds = increasing(counter / _FINE_HZ, where, table.first_line)
        rate = options.rate_hz or _rate_of(facts) or 1.0 / np.median(np.diff(seconds))
        return np.rint(seconds * rate).astype(np.int64), False
    return np.arange(len(table.rows)), False


def _rate_of(facts: dict[str, str]) -> float | None:
    match = re.match(r"([0-9.]+)", facts.get("Update Rate", ""))
    return float(match[1]) if match and float(match[1]) > 0 else None


def _rate(file: _File) -> float:
    rate = _rate_of(file.facts)
    if rate is None:
        raise InputError(
            f"{file.table.path}: no comment '// Update Rate: ...'; give the rate (--rate HZ)"
        )
    return rate


def _samples(file: _File, packets: np.ndarray, rate: float) -> SensorSamples:
    table = file.table
    time = np.arange(packets[0], packets[-1] + 1) / rate
    triple = lambda what: _columns(table, tuple(f"{what}_{axis}" for axis in "XYZ"))  # noqa: E731
    magnetic = with_gaps(packets, triple("Mag"))
    return SensorSamples(
        file.serial, time, rate, with_gaps(packets, triple("Acc")),
        with_gaps(packets, triple("Gyr")), with_gaps(packets, _orientation(table)),
        magnetic=magnetic,
    )  # fmt: skip


def _columns(table: TextTable, names: tuple[str, ...]) -> np.ndarray | None:
    if not table.has(names[0]):
        return None
    return table.columns(names)


def _orientation(table: TextTable) -> np.ndarray | None:
    if table.has(_MATRIX[0]):
        matrices = table.columns(_MATRIX).reshape(-1, 3, 3)
        return quaternions_of_matrices(matrices, str(table.path))
    for names in _QUATERNIONS:
        if table.has(names[0]):
            return table.columns(names)
    return None


def _facts(read: list[_File], rate: float, given: bool) -> dict[str, str | float | int | bool]:
    first = read[0].facts
    has_counter = read[0].table.has("PacketCounter")
    facts: dict[str, str | float | int | bool] = {
        "device": "Xsens MT",
        "sampling_rate_hz": rate,
        "clock": ("packet counter" if has_counter else "sample time") + " at the update rate "
        + ("given" if given else "of the files"),
    }  # fmt: skip
    for key in ("Start Time", "Filter Profile", "Firmware Version", "Option Flags"):
        if key in first:
            facts[key.lower().replace(" ", "_")] = first[key]
    return facts


def _start(read: list[_File], clocks: list[np.ndarray], rate: float) -> int | None:
    """Absolute time of packet zero, where the first file says UTC."""
    table = read[0].table
    names = [f"UTC_{part}" for part in ("Year", "Month", "Day", "Hour", "Minute", "Second")]
    if not table.has(*names):
        return None
    values = [float(table.column(n)[0]) for n in names]
    if not np.isfinite(values).all() or values[0] < 1971:
        return None
    year, month, day, hour, minute, second = (int(v) for v in values)
    try:
        moment = datetime.datetime(year, month, day, hour, minute, second, tzinfo=datetime.UTC)
    except ValueError:
        return None
    nano = float(table.column("UTC_Nano")[0]) if table.has("UTC_Nano") else 0.0
    first = int(moment.timestamp()) * 10**9 + int(nano if np.isfinite(nano) else 0)
    return first - round(int(clocks[0][0]) / rate * 1e9)
