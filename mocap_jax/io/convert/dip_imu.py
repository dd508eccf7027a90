"""DIP-IMU (Huang et al. 2018): pickles with `imu_ori`, `imu_acc` and the SMPL pose `gt`.

17 sensors at 60 Hz. `imu_ori` (n, 17, 3, 3) maps the sensor, already aligned with its bone, to the
SMPL world (Y up); `imu_acc` (n, 17, 3) is in that world, gravity removed [m/s^2]. There are no
gyroscope readings. Pickles can run programs when they are opened, so only arrays are let through.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.io.convert.convention import Convention, quaternions_of_matrices
from mocap_jax.io.convert.paths import files_of, one_file
from mocap_jax.io.convert.source import ReadOptions, SensorSamples, Source

NAME = "dip-imu"
SUMMARY = "DIP-IMU's pickles"
CONVENTION = Convention(
    quaternion_order=None, acceleration="free-world", world_up="y",
    heading="the SMPL world: z axis along the view direction of the first pose",
)  # fmt: skip
RATE_HZ = 60.0
SENSORS = {
    "head": "Head", "spine2": "T8", "belly": "Pelvis", "lchest": "LeftShoulder",
    "rchest": "RightShoulder", "lshoulder": "LeftUpperArm", "rshoulder": "RightUpperArm",
    "lelbow": "LeftForeArm", "relbow": "RightForeArm", "lhip": "LeftUpperLeg",
    "rhip": "RightUpperLeg", "lknee": "LeftLowerLeg", "rknee": "RightLowerLeg",
    "lwrist": "LeftHand", "rwrist": "RightHand", "lankle": "LeftFoot", "rankle": "RightFoot",
}  # fmt: skip
"""Sensors in the data set's order, with their segments."""
_ALLOWED = {
    ("numpy", "ndarray"), ("numpy", "dtype"), ("numpy.core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"), ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"), ("numpy._core.numeric", "_frombuffer"),
    ("numpy.core.numeric", "_frombuffer"), ("_codecs", "encode"),
}  # fmt: skip


class _ArraysOnly(pickle.Unpickler):
    """Refuses everything but arrays."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _ALLOWED:
            raise pickle.UnpicklingError(f"it holds a {module}.{name}, which is no array")
        return super().find_class(module, name)


def recognises(paths: list[Path]) -> bool:
    """Whether this is a pickle."""
    return bool(files_of(paths, (".pkl",)))


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read one pickle.

    Raises:
        InputError: not a pickle of arrays, or not of this data set.
    """
    file = one_file(paths, (".pkl",), "DIP-IMU pickle")
    content = _load(file)
    for key in ("imu_ori", "imu_acc"):
        if key not in content:
            raise InputError(f"{file}: lacks '{key}'; it holds {', '.join(map(str, content))}")
    matrices = np.asarray(content["imu_ori"], float)
    acceleration = np.asarray(content["imu_acc"], float)
    n, count = len(matrices), len(SENSORS)
    if matrices.shape != (n, count, 3, 3) or acceleration.shape != (n, count, 3) or not n:
        raise InputError(
            f"{file}: imu_ori has shape {matrices.shape} and imu_acc {acceleration.shape}, "
            f"expected (n, {count}, 3, 3) and (n, {count}, 3)"
        )
    rate = options.rate_hz or RATE_HZ
    sensors = tuple(
        SensorSamples(
            name, np.arange(n) / rate, rate, acceleration[:, i],
            orientation=quaternions_of_matrices(matrices[:, i], f"{file}: {name}"),
            segment=segment,
        )
        for i, (name, segment) in enumerate(SENSORS.items())
    )  # fmt: skip
    left = ("The SMPL pose 'gt' is left out.",) if "gt" in content else ()
    return Source(
        NAME, str(file), sensors, CONVENTION,
        {"device": "Xsens MTw (DIP-IMU)", "sampling_rate_hz": rate,
         "clock": "frames at the data set's rate", "mounting": "sensors aligned with their bones"},
        remarks=left,
    )  # fmt: skip


def _load(file: Path) -> dict[str, Any]:
    if not file.is_file():
        raise InputError(f"{file}: no such file")
    try:
        with open(file, "rb") as stream:
            content = _ArraysOnly(stream, encoding="latin1").load()
    except (pickle.UnpicklingError, EOFError, ValueError, IndexError, KeyError, TypeError,
            AttributeError, ImportError) as error:  # fmt: skip
        raise InputError(f"{file}: not a readable DIP-IMU pickle: {error}") from error
    if not isinstance(content, dict):
        raise InputError(f"{file}: holds a {type(content).__name__}, expected a dictionary")
    return content
