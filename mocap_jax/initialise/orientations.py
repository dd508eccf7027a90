"""`with_orientations`: orientations for recordings whose sensors measure none, by VQF.

VQF (Laidig & Seel 2023, doi 10.1016/j.inffus.2022.10.014) in its offline form looks at the whole
recording, forwards and backwards. Without a magnetometer each sensor's heading starts anywhere and
drifts slowly.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.recording import InertialStream, MagneticStream, Recording

# Shorter gaps are bridged by interpolation, longer ones part the recording [s].
_GAP = 0.5
# Pieces shorter than this have no orientation [s].
_SHORTEST = 0.5


def with_orientations(
    recording: Recording,
    *,
    magnetometer: bool = False,
    sensors: tuple[str, ...] | None = None,
) -> Recording:
    """The recording with orientations estimated from each sensor's own readings.

    Args:
        recording: with accelerometers and gyroscopes.
        magnetometer: use magnetic fields where there are any: a common heading (x axis east, as of
            VQF's east-north-up world), and disturbances of the field are rejected within limits.
        sensors: which sensors; default those that have no orientation at all.

    Raises:
        InputError: the package `vqf` is not installed, an unknown sensor, one without readings
            of accelerometer and gyroscope, or, with `magnetometer`, without a field.
    """
    chosen = _chosen(recording, sensors)
    inertial, lost = dict(recording.inertial), list(recording.salvage)
    for name in chosen:
        field = _field(recording, name) if magnetometer else None
        orientation, parts = _orientation(name, recording.inertial[name], field)
        inertial[name] = dataclasses.replace(recording.inertial[name], orientation=orientation)
        if parts > 1:
            lost.append(
                f"Sensor {name}: gaps part its readings into {parts} pieces; orientation starts "
                "anew in each."
            )
    if not chosen:
        return recording
    kind = "offline VQF with magnetometer" if magnetometer else "offline VQF without magnetometer"
    heading = "magnetic east" if magnetometer else "each sensor its own: not comparable"
    facts = recording.setup.provenance | {
        "orientation": f"{kind}: {', '.join(chosen)}", "heading": heading,
    }  # fmt: skip
    setup = dataclasses.replace(recording.setup, provenance=facts)
    return dataclasses.replace(recording, inertial=inertial, setup=setup, salvage=tuple(lost))


def _chosen(recording: Recording, sensors: tuple[str, ...] | None) -> tuple[str, ...]:
    for name in sensors or ():
        if name not in recording.inertial:
            raise unknown_name("sensor", name, recording.inertial)
    chosen = tuple(recording.inertial) if sensors is None else sensors
    out = []
    for name in chosen:
        stream = recording.inertial[name]
        if sensors is None and np.isfinite(np.asarray(stream.orientation)).any():
            continue
        for kind in ("accelerometer", "gyroscope"):
            if not np.isfinite(np.asarray(getattr(stream, kind))).all(axis=1).any():
                raise InputError(f"sensor {name} has no {kind}: its orientation is not to be had")
        out.append(name)
    return tuple(out)


def _field(recording: Recording, name: str) -> MagneticStream:
    if name not in recording.magnetic:
        have = ", ".join(recording.magnetic) or "none"
        raise InputError(f"sensor {name} has no magnetic field; sensors that have one: {have}")
    return recording.magnetic[name]


def _orientation(
    name: str, stream: InertialStream, magnetic: MagneticStream | None
) -> tuple[Float[np.ndarray, "n 4"], int]:
    """Orientations at the stream's samples (NaN where readings miss), and number of pieces."""
    try:
        from vqf import offlineVQF
    except ImportError as error:
        raise InputError(
            "orientations by VQF need the package vqf (pip install 'mocap_jax[convert]')"
        ) from error
    time = np.asarray(stream.time, float)
    readings = np.hstack([stream.accelerometer, stream.gyroscope]).astype(float)
    good = np.flatnonzero(np.isfinite(readings).all(axis=1))
    out = np.full((len(time), 4), np.nan)
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    key = "quat6D" if magnetic is None else "quat9D"
    pieces = [
        p for p in np.split(good, np.flatnonzero(np.diff(time[good]) > _GAP) + 1)
        if len(p) > 1 and time[p[-1]] - time[p[0]] >= _SHORTEST
    ]  # fmt: skip
    for piece in pieces:
        at = time[piece]
        grid = at[0] + np.arange(int(np.rint((at[-1] - at[0]) / step)) + 1) * step
        even = _at(grid, at, readings[piece])
        field = None
        if magnetic is not None:
            known = np.isfinite(np.asarray(magnetic.field)).all(axis=1)
            if not known.any():
                raise InputError(f"sensor {name}: its magnetic field holds no values")
            field = _at(grid, np.asarray(magnetic.time)[known], np.asarray(magnetic.field)[known])
        result = offlineVQF(
            np.ascontiguousarray(even[:, 3:]), np.ascontiguousarray(even[:, :3]),
            None if field is None else np.ascontiguousarray(field), step,
        )  # fmt: skip
        # VQF's k-th orientation is that after the k-th rate, which is the mean over a step whose
        # middle is stamped: half a step back.
        end = Rotation.from_quat(result[key], scalar_first=True)
        middle = end * Rotation.from_rotvec(-0.5 * step * even[:, 3:])
        near = np.clip(np.rint((at - grid[0]) / step).astype(int), 0, len(grid) - 1)
        out[piece] = middle.as_quat(scalar_first=True)[near]
    return out, len(pieces)


def _at(wanted: np.ndarray, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(wanted, time, column) for column in values.T], axis=1)
