"""APDM recordings (Opal v2 and later, Mobility Lab): HDF5, and CSV with the same quantities.

HDF5: `/Sensors/<id>/{Time, Accelerometer, Gyroscope, Magnetometer}` (microseconds since 1970,
m/s^2, rad/s, uT), the attributes `Label 0` and `Sample Rate` of `/Sensors/<id>/Configuration`, and
`/Processed/<id>/Orientation` (wxyz, sensor to a north-west-up world).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.io.convert.clock import increasing, nominal_rate
from mocap_jax.io.convert.convention import Convention
from mocap_jax.io.convert.hdf5 import open_hdf5
from mocap_jax.io.convert.paths import files_of, one_file, over
from mocap_jax.io.convert.source import ReadOptions, SensorSamples, Source

NAME = "apdm"
SUMMARY = "HDF5 recordings of APDM Opal (v2 and later)"
CONVENTION = Convention(
    magnetometer_unit="uT", heading="magnetic north-west-up (x axis to magnetic north)"
)
_SUFFIXES = (".h5", ".hdf5")


def recognises(paths: list[Path]) -> bool:
    """Whether this is an HDF5 file."""
    return bool(files_of(paths, _SUFFIXES))


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read one file.

    Raises:
        InputError: not HDF5, another layout, a missing data set, unequal lengths.
    """
    file = one_file(paths, _SUFFIXES, "APDM recording")
    with open_hdf5(file) as document:
        if "Sensors" not in document:
            raise InputError(
                f"{file}: no group /Sensors (expected an Opal v2 recording); it holds "
                f"{', '.join(document) or 'nothing'}"
            )
        groups = document["Sensors"]
        if not len(groups):
            raise InputError(f"{file}: /Sensors is empty")
        starts = [_epoch(groups[i], f"{file}: /Sensors/{i}") for i in groups]
        zero = min(starts)
        processed = document.get("Processed", {})
        sensors = tuple(
            _sensor(i, groups[i], processed.get(i), zero, f"{file}: /Sensors/{i}", options)
            for i in over(list(groups), options.progress)
        )
    return Source(
        NAME, str(file), sensors, CONVENTION,
        {"device": "APDM Opal", "sampling_rate_hz": sensors[0].rate_hz,
         "clock": "synchronised microseconds since 1970"},
        start_utc_ns=zero * 1000,
    )  # fmt: skip


def _data(group: Any, name: str, width: int | None, where: str) -> np.ndarray:
    if name not in group:
        raise InputError(f"{where}: lacks {name}; it holds {', '.join(group)}")
    values = np.asarray(group[name])
    if width is not None and values.ndim == 2 and values.shape[1] != width:
        values = values.T
    if values.ndim != (1 if width is None else 2) or (width and values.shape[1] != width):
        raise InputError(f"{where}/{name}: has shape {values.shape}, expected (n, {width or 1})")
    return values


def _epoch(group: Any, where: str) -> int:
    time = _data(group, "Time", None, where)
    if not len(time):
        raise InputError(f"{where}: Time is empty")
    return int(time[0])


def _sensor(
    identity: str, group: Any, processed: Any, zero: int, where: str, options: ReadOptions
) -> SensorSamples:
    ticks = _data(group, "Time", None, where).astype(np.int64)
    time = increasing((ticks - zero) * 1e-6, where)
    values = {
        name: _data(group, name, 3, where).astype(float)
        for name in ("Accelerometer", "Gyroscope", "Magnetometer")
        if name in group or name == "Accelerometer"
    }
    orientation = None
    if processed is not None and "Orientation" in processed:
        orientation = _data(processed, "Orientation", 4, where).astype(float)
        values["Orientation"] = orientation
    for name, rows in values.items():
        if len(rows) != len(time):
            raise InputError(f"{where}: {name} has {len(rows)} rows for {len(time)} times")
    attributes = dict(group["Configuration"].attrs) if "Configuration" in group else {}
    rate = options.rate_hz or _number(attributes.get("Sample Rate"))
    return SensorSamples(
        identity, time, nominal_rate(time, rate, where), values["Accelerometer"],
        values.get("Gyroscope"), orientation, magnetic=values.get("Magnetometer"),
        segment=_text(attributes.get("Label 0")),
    )  # fmt: skip


def _number(value: Any) -> float | None:
    if value is None:
        return None
    number = float(np.ravel(value)[0])
    return number if number > 0 else None


def _text(value: Any) -> str | None:
    if value is None:
        return None
    text = np.ravel(value)[0] if not isinstance(value, bytes | str) else value
    text = text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)
    return text.replace("\x00", "").strip() or None
