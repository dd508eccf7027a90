"""TotalCapture (Trumble et al. 2017): `*_Xsens.sensors` and `*_Xsens_AuxFields.sensors`.

The first line holds the number of sensors and of frames; each frame is its number on a line and a
line a sensor: name, quaternion (wxyz, sensor to world), acceleration [m/s^2, sensor frame, gravity
included], and in the `AuxFields` files angular velocity [rad/s] and magnetic field (normalised).
60 Hz. The calibration files beside them (`calib_imu_bone`, `calib_imu_ref`) tie sensors to the
data set's own skeleton and are left alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.io.convert.clock import plausible_gaps
from mocap_jax.io.convert.convention import Convention
from mocap_jax.io.convert.paths import files_of, one_file
from mocap_jax.io.convert.source import ReadOptions, SensorSamples, Source

NAME = "totalcapture"
SUMMARY = "TotalCapture's .sensors files"
CONVENTION = Convention(magnetometer_unit="a.u.", heading="Xsens' world (x axis to magnetic north)")
RATE_HZ = 60.0
_WIDTHS = {8: 7, 14: 13}
"""Words on a sensor's line -> numbers."""


def recognises(paths: list[Path]) -> bool:
    """Whether this is such a file."""
    return bool(files_of(paths, (".sensors",)))


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read one file; one that breaks off is read up to its last whole frame.

    Raises:
        InputError: not such a file, a sensor missing from a frame, a word that is no number.
    """
    file = one_file(paths, (".sensors",), "TotalCapture file")
    try:
        lines = [line.split() for line in file.read_text(encoding="utf-8").splitlines()]
    except (UnicodeDecodeError, OSError) as error:
        raise InputError(f"{file}: not a readable text file") from error
    numbered = [(i, words) for i, words in enumerate(lines, start=1) if words]
    count, declared = _header(file, numbered)
    names, values, frames, lost = _frames(file, numbered[1:], count)
    if frames[-1] - frames[0] + 1 < declared and not lost:
        lost = (f"{file.name}: declares {declared} frames, holds {len(frames)}.",)
    plausible_gaps(frames, str(file))
    rate = options.rate_hz or RATE_HZ
    grid = np.arange(frames[-1] - frames[0] + 1)
    full = np.full((len(grid), count, values.shape[2]), np.nan)
    full[frames - frames[0]] = values
    aux = values.shape[2] == 13
    sensors = tuple(
        SensorSamples(
            name, grid / rate, rate, full[:, i, 4:7], full[:, i, 7:10] if aux else None,
            full[:, i, :4], magnetic=full[:, i, 10:13] if aux else None,
        )
        for i, name in enumerate(names)
    )  # fmt: skip
    return Source(
        NAME, str(file), sensors, CONVENTION,
        {"device": "Xsens MVN (TotalCapture)", "sampling_rate_hz": rate,
         "clock": "frame numbers at the data set's rate"},
        lost, () if aux else ("No angular velocities: use the AuxFields file for them.",),
    )  # fmt: skip


def _header(file: Path, numbered: list[tuple[int, list[str]]]) -> tuple[int, int]:
    try:
        count, declared = (int(word) for word in numbered[0][1])
    except (IndexError, ValueError):
        raise InputError(
            f"{file}: the first line must hold the number of sensors and of frames"
        ) from None
    if count < 1 or len(numbered) < count + 2:
        raise InputError(f"{file}: holds no frame of {count} sensors")
    return count, declared


def _frames(
    file: Path, numbered: list[tuple[int, list[str]]], count: int
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray, tuple[str, ...]]:
    """Sensor names, values (frames, sensors, 7 or 13), frame numbers, and what was lost."""
    names = tuple(words[0] for _, words in numbered[1 : count + 1])
    width = len(numbered[1][1])
    if width not in _WIDTHS:
        raise InputError(
            f"{file}: line {numbered[1][0]}: {width} words, expected a name and 7 or 13 numbers"
        )
    whole = len(numbered) // (count + 1)
    values: list[list[np.ndarray]] = []
    frames: list[int] = []
    for k in range(whole):
        (line, number), *block = numbered[k * (count + 1) : (k + 1) * (count + 1)]
        last = k == whole - 1
        if len(number) != 1 or not number[0].lstrip("-").isdigit():
            raise InputError(f"{file}: line {line}: expected a frame number")
        if last and len(block[-1][1]) < width:
            return names, *_stacked(values, frames, file), (_broken(file, whole - 1),)
        frames.append(int(number[0]))
        values.append([_sensor(file, at, w, names[i], width) for i, (at, w) in enumerate(block)])
    lost = (_broken(file, whole),) if len(numbered) % (count + 1) else ()
    return names, *_stacked(values, frames, file), lost


def _stacked(
    values: list[list[np.ndarray]], frames: list[int], file: Path
) -> tuple[np.ndarray, np.ndarray]:
    numbers = np.array(frames)
    if not len(numbers):
        raise InputError(f"{file}: holds no whole frame")
    if (np.diff(numbers) <= 0).any():
        i = int(np.flatnonzero(np.diff(numbers) <= 0)[0])
        raise InputError(f"{file}: frame {numbers[i + 1]} follows frame {numbers[i]}")
    return np.array(values), numbers


def _broken(file: Path, whole: int) -> str:
    return f"{file.name}: breaks off after {whole} whole frames."


def _sensor(file: Path, line: int, words: list[str], name: str, width: int) -> np.ndarray:
    if len(words) != width or words[0] != name:
        raise InputError(
            f"{file}: line {line}: expected sensor {name} with {width - 1} numbers, found "
            f"'{words[0]}' with {len(words) - 1}"
        )
    try:
        return np.array(words[1:], float)
    except ValueError as error:
        raise InputError(f"{file}: line {line}: {error}") from None
