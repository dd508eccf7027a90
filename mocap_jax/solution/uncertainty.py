"""`uncertainty`: stated uncertainty of what people read, as one labelled table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mocap_jax.solution.angles import joint_angles
from mocap_jax.solution.pose_jacobians import PoseJacobians
from mocap_jax.solution.poses import dof_names, root_segment
from mocap_jax.solution.propagate import (
    joint_angle_rate_std,
    joint_angle_std,
    segment_covariances,
    velocity_std,
)
from mocap_jax.solution.solution import Solution

if TYPE_CHECKING:
    import xarray

_ROTATION = "rotation vector of the error, true = Exp(e) estimated, in the {frame} frame"
_POSITION = "position of the segment's origin (its joint centre) in the {frame} frame"
_COVARIANCE = ("time", "segment", "xyz", "xyz_other")


def uncertainty(solution: Solution) -> xarray.Dataset:
    """Standard deviations and covariances of angles, orientations, positions and velocities.

    All follow, to first order, from the covariance of the pose (`Solution.covariance`):

    - `joint_angle_std` (time, angle) [rad]: of the angles of `Solution.to_xarray`. Near gimbal
      lock those of the two outer Cardan angles grow without bound.
    - `segment_orientation_std`, `segment_position_std` (time, segment, xyz) [rad, m] and
      `..._covariance` (time, segment, xyz, xyz_other) [rad^2, m^2]: in the world frame.
    - the same with `_in_root`: of the rotation and position relative to the root segment, in its
      frame. They do not depend on how well the root's own pose is known; the root's own are zero.
    - where the solution has `pair_covariance`, between frames (the dimension `interval`, its times
      the middles): `joint_angle_rate`, `joint_angle_rate_std` [rad/s], differences of successive
      angles over the step, and `velocity_std` (interval, dof) [rad/s, m/s], of the tangent vector
      between successive poses over the step.

    Units, frames and definitions stand in the attributes of each variable.

    Raises:
        InputError: the solution has no covariance.
    """
    import xarray

    topology = solution.body.topology
    names, std = joint_angle_std(solution)
    variables: dict[str, tuple] = {
        "joint_angle_std": (("time", "angle"), std, {"units": "rad", "frame": "parent segment"}),
        **_segment_variables(solution),
    }
    time = np.asarray(solution.trajectory.time)
    coordinates: dict[str, object] = {
        "time": ("time", time, {"units": "s"}),
        "angle": list(names),
        "segment": list(topology.body_names[1:]),
        "xyz": ["x", "y", "z"],
        "xyz_other": ["x", "y", "z"],
    }
    if solution.pair_covariance is not None:
        variables |= _velocity_variables(solution)
        middle = 0.5 * (time[1:] + time[:-1])
        coordinates |= {
            "interval": ("interval", middle, {"units": "s"}), "dof": list(dof_names(topology)),
        }  # fmt: skip
    attributes = {"method": solution.method, "status": solution.status.value}
    return xarray.Dataset(variables, coordinates, attributes)


def _segment_variables(solution: Solution) -> dict[str, tuple]:
    found: PoseJacobians = segment_covariances(solution)
    root = solution.body.topology.body_names[root_segment(solution.body.topology)]
    out: dict[str, tuple] = {}
    for suffix, frame, orientation, position in (
        ("", "world", found.orientation, found.position),
        ("_in_root", root, found.orientation_in_root, found.position_in_root),
    ):
        for kind, unit, text, value in (
            ("orientation", "rad", _ROTATION, orientation), ("position", "m", _POSITION, position),
        ):  # fmt: skip
            # The world itself, which is certain, is no segment.
            P = np.asarray(value)[:, 1:]
            std = np.sqrt(np.maximum(np.diagonal(P, axis1=2, axis2=3), 0.0))
            about = {"frame": frame, "description": text.format(frame=frame)}
            name = f"segment_{kind}{suffix}"
            out[f"{name}_std"] = (("time", "segment", "xyz"), std, about | {"units": unit})
            out[f"{name}_covariance"] = (_COVARIANCE, P, about | {"units": f"{unit}^2"})
    return out


def _velocity_variables(solution: Solution) -> dict[str, tuple]:
    time = np.asarray(solution.trajectory.time)
    _, angles = joint_angles(solution.body, solution.trajectory)
    rate = np.diff(angles, axis=0) / np.diff(time)[:, None]
    about = {"units": "rad/s", "description": "change between successive frames over the step"}
    of_dof = about | {"description": "tangent vector between successive poses over the step; root "
                      "translation and slides in m/s"}  # fmt: skip
    return {
        "joint_angle_rate": (("interval", "angle"), rate, about),
        "joint_angle_rate_std": (
            ("interval", "angle"), joint_angle_rate_std(solution, angles), about,
        ),
        "velocity_std": (("interval", "dof"), velocity_std(solution), of_dof),
    }  # fmt: skip
