"""How well a calibrated body follows the measured orientations: at rest, and over the motion."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.estimate.mounting.result import MountingCalibration
from mocap_jax.estimate.orientation_options import OrientationPassOptions
from mocap_jax.estimate.orientation_pass import orientation_pass
from mocap_jax.recording import InertialStream, Recording

# Poses fitted over a motion: enough to see a sensor that disagrees.
_POSES, _AT_REST = 300, 5
# Between them a motion may go far: each starts from the one before.
_ONE_BY_ONE = OrientationPassOptions(warm_start=True)


def pose_at_rest(result: MountingCalibration, stated: np.ndarray) -> MountingCalibration:
    """With the pose at rest in which all sensors are as measured: limbs turned, else as stated."""
    start, end = result.rest
    at_rest = _sampled(result.recording, np.linspace(start, end, _AT_REST))
    fit = orientation_pass(at_rest, result.body, start=stated, options=_ONE_BY_ONE)
    return dataclasses.replace(result, pose=np.asarray(fit.trajectory.q)[_AT_REST // 2])


def sensor_misfits(result: MountingCalibration) -> MountingCalibration:
    """With the misfit of each sensor over the motion."""
    first, last = result.recording.interval
    times = np.linspace(first, last, _POSES)
    motion = _sampled(result.recording, times)
    fit = orientation_pass(motion, result.body, start=result.pose, options=_ONE_BY_ONE)
    sensors = tuple(
        dataclasses.replace(
            s, misfit=float(fit.statistics.get(f"orientation/{s.sensor}", {}).get("rms", np.nan))
        )
        for s in result.sensors
    )
    return dataclasses.replace(result, sensors=sensors)


def _sampled(recording: Recording, times: np.ndarray) -> Recording:
    """Orientations nearest to some times, without anything else."""
    streams = {}
    for name, stream in recording.inertial.items():
        time, quat = np.asarray(stream.time), np.asarray(stream.orientation)
        known = np.flatnonzero(np.isfinite(quat).all(axis=1))
        near = known[np.abs(time[known][None] - times[:, None]).argmin(axis=1)]
        none = np.full((len(times), 3), np.nan)
        streams[name] = InertialStream(times, none, none, quat[near])
    return dataclasses.replace(recording, inertial=streams, root=None, ranges=None, magnetic={})
