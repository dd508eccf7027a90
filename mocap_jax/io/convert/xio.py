"""CSV exports of x-io devices (x-IMU3, NGIMU): a folder a device, a file a kind of message.

x-IMU3: `Inertial.csv`, `Quaternion.csv`, `Magnetometer.csv` with `Timestamp (us)` or `Time (s)`.
NGIMU: `sensors.csv` and `quaternion.csv` with `Time (s)`. Rates are in deg/s, accelerations in g,
fields in uT or normalised; each file has its own rate. Quaternions come at their own times and are
interpolated to those of the inertial samples.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from mocap_jax.errors import InputError
from mocap_jax.io.convert.clock import increasing, nominal_rate
from mocap_jax.io.convert.convention import Convention
from mocap_jax.io.convert.paths import over
from mocap_jax.io.convert.source import ReadOptions, SensorSamples, Source
from mocap_jax.io.convert.text_table import TextTable, read_table

NAME = "x-io"
SUMMARY = "CSV exports of x-io devices (x-IMU3, NGIMU), a folder a device"
CONVENTION = Convention(
    accelerometer_unit="g", gyroscope_unit="deg/s",
    heading="the device's Earth frame (x axis to magnetic north by default)",
)  # fmt: skip
_INERTIAL = ("inertial.csv", "sensors.csv")
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
_TIME = re.compile(r"^(time|timestamp)\s*\((?P<unit>[^)]+)\)$", re.IGNORECASE)
_COLUMN = re.compile(r"^(?P<what>.*?)\s*(?P<axis>[WXYZ])?\s*(\((?P<unit>[^)]*)\))?$")
# Orientations are interpolated over at most so much time [s].
_GAP = 0.1


def recognises(paths: list[Path]) -> bool:
    """Whether these are device folders, or a folder of them."""
    return bool(_devices(paths))


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read the devices of one recording.

    Raises:
        InputError: no device folders, a missing column, time that runs backwards.
    """
    folders = _devices(paths)
    if not folders:
        raise InputError(
            f"{paths[0]}: no x-io device there (a folder with Inertial.csv or sensors.csv)"
        )
    sensors, lost = [], []
    units: dict[str, str] = {}
    for folder in over(folders, options.progress):
        sensor, salvage, found = _device(folder, options)
        sensors.append(sensor)
        lost += salvage
        for key, unit in found.items():
            if units.setdefault(key, unit) != unit:
                raise InputError(
                    f"{folder}: {key.replace('_', ' ')} is {unit}, of the devices before it "
                    f"{units[key]}; convert them apart"
                )
    return Source(
        NAME, str(paths[0]), tuple(sensors), Convention(**{**CONVENTION.__dict__, **units}),
        {"device": "x-io", "sampling_rate_hz": sensors[0].rate_hz,
         "clock": "time stamps of the devices (synchronised ones share it)"},
        tuple(lost),
    )  # fmt: skip


def _devices(paths: list[Path]) -> list[Path]:
    out: list[Path] = []
    for path in paths:
        folders = [path, *sorted(p for p in path.iterdir() if p.is_dir())] if path.is_dir() else []
        out += [f for f in folders if _file(f, *_INERTIAL) is not None]
    return list(dict.fromkeys(out))


def _file(folder: Path, *names: str) -> Path | None:
    files = {f.name.lower(): f for f in folder.iterdir() if f.is_file()}
    return next((files[n] for n in names if n in files), None)


def _device(folder: Path, options: ReadOptions) -> tuple[SensorSamples, list[str], dict[str, str]]:
    file = _file(folder, *_INERTIAL)
    assert file is not None
    table = read_table(file)
    time = _time(table)
    accelerometer, unit = _triple(table, "Accelerometer")
    gyroscope, rate_unit = _triple(table, "Gyroscope")
    units = {"accelerometer_unit": unit or "g", "gyroscope_unit": rate_unit or "deg/s"}
    lost = list(table.salvage)
    orientation, text = _orientation(folder, time)
    lost += text
    magnetic_time, magnetic, field_unit, text = _magnetic(folder, table, time)
    lost += text
    if magnetic is not None:
        units["magnetometer_unit"] = field_unit or "uT"
    return (
        SensorSamples(
            folder.name, time, nominal_rate(time, options.rate_hz, str(file)), accelerometer,
            gyroscope, orientation, magnetic_time, magnetic,
        ),
        lost,
        units,
    )  # fmt: skip


def _time(table: TextTable) -> np.ndarray:
    for name in table.names:
        match = _TIME.match(name)
        if match and match["unit"] in _TIMES:
            seconds = table.column(name) * _TIMES[match["unit"]]
            return increasing(seconds, str(table.path), table.first_line)
    raise InputError(
        f"{table.path}: no column 'Time (s)' or 'Timestamp (us)'; columns: {', '.join(table.names)}"
    )


def _triple(
    table: TextTable, what: str, axes: str = "XYZ", *, optional: bool = False
) -> tuple[np.ndarray | None, str | None]:
    """Columns `<what> X (unit)` and so on, and their unit."""
    found, unit = [], None
    for axis in axes:
        for name in table.names:
            match = _COLUMN.match(name)
            if match and match["axis"] == axis and match["what"].lower() == what.lower():
                found.append(name)
                unit = match["unit"]
    if len(found) != len(axes):
        if optional and not found:
            return None, None
        raise InputError(
            f"{table.path}: no columns '{what} {axes[0]}' to '{what} {axes[-1]}'; columns: "
            f"{', '.join(table.names)}"
        )
    return table.columns(found), unit


def _orientation(folder: Path, time: np.ndarray) -> tuple[np.ndarray | None, list[str]]:
    file = _file(folder, "quaternion.csv")
    if file is None:
        return None, []
    table = read_table(file)
    what = "Quaternion" if any("quaternion" in n.lower() for n in table.names) else ""
    quaternion, _ = _triple(table, what, "WXYZ")
    assert quaternion is not None
    return interpolated(_time(table), quaternion, time), list(table.salvage)


def _magnetic(
    folder: Path, inertial: TextTable, time: np.ndarray
) -> tuple[np.ndarray | None, np.ndarray | None, str | None, list[str]]:
    file = _file(folder, "magnetometer.csv")
    table = inertial if file is None else read_table(file)
    field, unit = _triple(table, "Magnetometer", optional=file is None)
    if file is None or field is None:
        return None, field, unit, []
    return _time(table), field, unit, list(table.salvage)


def interpolated(
    time: np.ndarray, quaternion: np.ndarray, wanted: np.ndarray, gap: float = _GAP
) -> np.ndarray:
    """Orientations at other times; NaN outside and within gaps."""
    good = np.isfinite(quaternion).all(axis=1) & (np.linalg.norm(quaternion, axis=1) > 1e-6)
    out = np.full((len(wanted), 4), np.nan)
    t = time[good]
    if not len(t):
        return out
    if len(t) == 1:
        out[wanted == t[0]] = quaternion[good][0]
        return out
    after = np.clip(np.searchsorted(t, wanted), 1, len(t) - 1)
    exact = (wanted == t[after]) | (wanted == t[after - 1])
    inside = (wanted >= t[0]) & (wanted <= t[-1]) & (exact | (t[after] - t[after - 1] <= gap))
    slerp = Slerp(t, Rotation.from_quat(quaternion[good], scalar_first=True))
    if inside.any():
        out[inside] = slerp(wanted[inside]).as_quat(scalar_first=True)
    return out
