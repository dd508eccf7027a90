"""Trials of the public two-segment rig (Weygers & Kok 2020; data by D. Lehmann), MATLAB files.

Two rigid segments joined at one point, an inertial sensor on each, an optical reference for both
orientations. The file gives the lever arms from each sensor to the joint.
"""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax import so3
from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.io.matlab_trial import load_trial
from mocap_jax.recording import InertialStream, NoiseFigures, Recording, RestHold, SensorSpec, Setup

SENSORS = ("first", "second")
"""Sensors, sites and segments alike."""
REFERENCE_LAG = 1
"""Inertial sample k + 1 was taken when the reference's sample k was (best match of rates)."""
_FIELDS = ("rate", "sensorData", "ref", "r_12", "r_21")
# Full scale of the gyroscopes: a reference that turns faster has lost its markers [rad/s].
_FASTEST = np.deg2rad(2000.0)
# Reference samples between two such jumps at most this far apart are lost as well [s].
_LOST = 0.2
# Declared noise: not the data sheet's, but what samples at 50 Hz of a rig that is swung at up to
# 20 rad/s are good for (aliasing, the two sensors' clocks) [m/s^2], [rad/s].
_ACCELEROMETER, _GYROSCOPE = 0.1, 0.01
_BODY = """<mujoco model="two_segment_rig">
  <worldbody>
    <body name="first">
      <freejoint name="root"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <site name="first" pos="{first}"/>
      <body name="second">
        <joint name="joint" type="ball"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
        <site name="second" pos="{second}"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@dataclass(frozen=True)
class RigTrial:
    """One trial: what the sensors measured, and the optical reference at the same samples."""

    recording: Recording
    """Sensors "first" and "second"; the reference's first sample is the declared start pose."""
    body: Body
    """Segment frames are the sensors' frames, both with their origin in the joint."""
    reference: Float[np.ndarray, "t 2 4"]
    """Orientations R_world_sensor (wxyz), brought to the inertial clock; NaN where unknown."""
    known: Bool[np.ndarray, "t"]
    """Samples whose reference exists and is not lost."""


def read_two_segment_rig(path: str | os.PathLike[str], *, seconds: float | None = None) -> RigTrial:
    """Read a trial.

    Args:
        path: `.mat` file of the rig.
        seconds: only the start of the trial [s].

    Raises:
        InputError: no such file, not a MATLAB file, or not a trial of the rig.
    """
    fields = _load(Path(path))
    rate = float(fields["rate"])
    count = len(fields["sensorData"]) if seconds is None else int(seconds * rate)
    samples = np.asarray(fields["sensorData"], float)[:count]
    reference, known = _reference(np.asarray(fields["ref"], float), rate)
    reference, known = reference[:count], known[:count]
    if len(samples) < 4 or not known.any():
        raise InputError(f"{path}: needs at least 4 samples and a known reference")
    # Lever arms point from sensor to joint; sites are placed from the joint.
    arms = {"first": -np.asarray(fields["r_12"]), "second": -np.asarray(fields["r_21"])}
    xml = _BODY.format(**{k: " ".join(f"{x:.9g}" for x in v) for k, v in arms.items()})
    time = np.arange(len(samples)) / rate
    unmeasured = np.full((len(time), 4), np.nan)
    inertial = {
        name: InertialStream(time, samples[:, at : at + 3], samples[:, at + 3 : at + 6], unmeasured)
        for name, at in zip(SENSORS, (0, 6), strict=True)
    }
    recording = Recording(
        inertial=inertial, ranges=None, root=None, magnetic={}, temperature=None, truth=None,
        setup=_setup(rate, reference[known][0], Path(path).name), body_xml=xml,
    )  # fmt: skip
    return RigTrial(recording, load_body(xml), reference, known)


def _load(path: Path) -> dict[str, np.ndarray]:
    content = load_trial(path, "the two-segment rig")
    data: Any = content.get("data")
    missing = [f for f in _FIELDS if not isinstance(data, dict) or f not in data]
    if missing:
        raise InputError(f"{path}: no trial of the two-segment rig: 'data' lacks {missing}")
    shapes = np.shape(data["sensorData"])[1:], np.shape(data["ref"])[1:]
    if shapes[0] != (12,) or not shapes[1] or shapes[1][0] < 8:
        raise InputError(f"{path}: expected sensorData (n, 12) and ref (n, 8 or more columns)")
    return data


def _reference(ref: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Both orientations on the inertial clock (t, 2, 4), and which samples are known."""
    quaternions = ref[:, :8].reshape(-1, 2, 4)
    norm = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    quaternions = quaternions / np.where(norm > 0.5, norm, np.nan)
    known = np.isfinite(quaternions).all((1, 2)) & ~_lost(quaternions, rate)
    out, valid = np.full_like(quaternions, np.nan), np.zeros(len(ref), bool)
    out[REFERENCE_LAG:] = quaternions[:-REFERENCE_LAG]
    valid[REFERENCE_LAG:] = known[:-REFERENCE_LAG]
    return out, valid


def _lost(quaternions: np.ndarray, rate: float) -> np.ndarray:
    """Samples around and between jumps that no sensor could have followed."""
    cosine = np.abs((quaternions[1:] * quaternions[:-1]).sum(-1)).clip(0, 1)
    jumps = np.flatnonzero((2 * np.arccos(cosine) * rate > _FASTEST).any(1))
    lost = np.zeros(len(quaternions), bool)
    for jump in jumps:
        lost[max(jump - 1, 0) : jump + 3] = True
    for first, last in itertools.pairwise(jumps):
        if last - first <= _LOST * rate:
            lost[first:last] = True
    return lost


def _setup(rate: float, start: np.ndarray, name: str) -> Setup:
    """Sensors, and the reference's first orientations as the declared pose of the first sample."""
    relative = np.asarray(so3.quat_multiply(so3.quat_conjugate(start[0]), start[1]))
    pose = {"root": (0.0, 0.0, 0.0, *map(float, start[0])), "joint": tuple(map(float, relative))}
    return Setup(
        sensors=tuple(SensorSpec(s, s, rate) for s in SENSORS),
        noise=NoiseFigures(accelerometer=_ACCELEROMETER, gyroscope=_GYROSCOPE),
        rest=RestHold(0.0, 0.0, pose),
        provenance={"device": "two-segment rig", "trial": name},
    )
