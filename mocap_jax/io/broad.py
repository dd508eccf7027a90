"""Trials of BROAD (Laidig, Caruso, Cereatti, Seel, Data 6(7), 2021), MATLAB files.

One inertial sensor on a rigid body, with an optical reference for its orientation. The file's
samples are taken as means over the interval that ends at their instant, as digital sensors deliver
them, so stamps (interval centres) are half a step earlier than the reference's instants.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax.errors import InputError
from mocap_jax.io.matlab_trial import load_trial
from mocap_jax.recording import InertialStream

_SHAPES = {"imu_gyr": (3,), "imu_acc": (3,), "opt_quat": (4,), "movement": ()}
_FIELDS = (*_SHAPES, "sampling_rate")


@dataclass(frozen=True)
class BroadTrial:
    """One trial: what the sensor measured, and the optical reference."""

    name: str
    """File name without suffix."""
    inertial: InertialStream
    """Rates and specific forces; the magnetometer is left out."""
    time: Float[np.ndarray, "n"]
    """Instants of the reference [s]: the ends of the samples' intervals."""
    reference: Float[np.ndarray, "n 4"]
    """R_world_sensor (wxyz), Z up; NaN in gaps."""
    scored: Bool[np.ndarray, "n"]
    """Samples of the movement phase with a reference."""


def read_broad(path: str | os.PathLike[str]) -> BroadTrial:
    """Read a trial.

    Args:
        path: `.mat` file of the data set.

    Raises:
        InputError: no such file, not a MATLAB file, or not a trial of BROAD.
    """
    fields = _load(Path(path))
    rate = float(fields["sampling_rate"])
    gyroscope, force = (np.asarray(fields[f], float) for f in ("imu_gyr", "imu_acc"))
    reference = np.asarray(fields["opt_quat"], float)
    scored = np.asarray(fields["movement"]).astype(bool) & np.isfinite(reference).all(axis=1)
    if not scored.any():
        raise InputError(f"{path}: no sample of the movement phase has a reference")
    time = np.arange(len(gyroscope)) / rate
    inertial = InertialStream(time - 0.5 / rate, force, gyroscope, np.full((len(time), 4), np.nan))
    return BroadTrial(Path(path).stem, inertial, time, reference, scored)


def _load(path: Path) -> dict[str, np.ndarray]:
    fields = load_trial(path, "BROAD")
    missing = [f for f in _FIELDS if f not in fields]
    if missing:
        raise InputError(f"{path}: no trial of BROAD: lacks {missing}; it needs {list(_FIELDS)}")
    count = len(np.atleast_1d(fields["imu_gyr"]))
    for name, columns in _SHAPES.items():
        if np.shape(fields[name]) != (count, *columns) or count < 2:
            expected = f"({', '.join(map(str, ('n', *columns)))})"
            raise InputError(
                f"{path}: '{name}' has shape {np.shape(fields[name])}, expected {expected} with "
                f"the n of imu_gyr, at least 2"
            )
    rate = np.asarray(fields["sampling_rate"], float)
    if rate.shape != () or not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{path}: 'sampling_rate' is {fields['sampling_rate']}, expected [Hz] > 0")
    return fields
