"""A solution as a labelled table: xarray (time x joint, units in attrs) or pandas."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mocap_jax.body.topology import FREE
from mocap_jax.solution.angles import joint_angles
from mocap_jax.solution.poses import dof_names, segment_poses

if TYPE_CHECKING:
    import pandas
    import xarray

    from mocap_jax.solution.solution import Solution


def solution_to_xarray(solution: Solution) -> xarray.Dataset:
    """Joint angles, segment poses and, where known, standard deviations, over time.

    Variables: `joint_angle` (time, angle) [rad], `segment_position` (time, segment, xyz) [m] and
    `segment_rotation` (time, segment, row, column) in the world frame, `standard_deviation`
    (time, dof) [rad or m] in the tangent space of the pose, and the standard deviations and rates
    of `uncertainty`. Units stand in the attributes.
    """
    import xarray

    from mocap_jax.solution.uncertainty import uncertainty

    topology = solution.body.topology
    names, angles = joint_angles(solution.body, solution.trajectory)
    R_world, position = segment_poses(solution.body, np.asarray(solution.trajectory.q))
    variables = {
        "joint_angle": (("time", "angle"), angles, {"units": "rad"}),
        "segment_position": (("time", "segment", "xyz"), position[:, 1:], {"units": "m"}),
        "segment_rotation": (
            ("time", "segment", "row", "column"), R_world[:, 1:],
            {"units": "1", "description": "segment to world coordinates"},
        ),
    }  # fmt: skip
    coordinates = {
        "time": ("time", np.asarray(solution.trajectory.time), {"units": "s"}),
        "angle": list(names),
        "segment": list(topology.body_names[1:]),
        "xyz": ["x", "y", "z"],
    }
    if solution.covariance is not None:
        variance = np.diagonal(np.asarray(solution.covariance), axis1=1, axis2=2)
        variables["standard_deviation"] = (
            ("time", "dof"), np.sqrt(np.maximum(variance, 0.0)),
            {"units": "rad", "description": "root translation and slides in m"},
        )  # fmt: skip
        coordinates["dof"] = list(dof_names(topology))
    attributes = {"method": solution.method, "status": solution.status.value}
    table = xarray.Dataset(variables, coordinates, attributes)
    if solution.covariance is None:
        return table
    stated = uncertainty(solution)
    return table.merge(stated.drop_dims("xyz_other"), combine_attrs="override")


def solution_to_dataframe(solution: Solution) -> pandas.DataFrame:
    """Root pose and joint angles, one row a frame, the index being time [s].

    Columns are `root/px|py|pz` [m], `root/qw|qx|qy|qz` (wxyz) and `<segment>/<angle>` [rad];
    `frame.attrs["units"]` holds the unit of each.
    """
    import pandas

    topology = solution.body.topology
    q = np.asarray(solution.trajectory.q)
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for joint, kind in enumerate(topology.joint_types):
        if kind != FREE:
            continue
        start = topology.joint_qpos[joint]
        for i, part in enumerate(("px", "py", "pz", "qw", "qx", "qy", "qz")):
            name = f"{topology.joint_names[joint]}/{part}"
            columns[name], units[name] = q[:, start + i], "m" if i < 3 else "1"
    names, angles = joint_angles(solution.body, solution.trajectory)
    columns |= dict(zip(names, angles.T, strict=True))
    units |= dict.fromkeys(names, "rad")
    index = pandas.Index(np.asarray(solution.trajectory.time), name="time")
    frame = pandas.DataFrame(columns, index=index)
    frame.attrs = {"units": units, "time_units": "s"}
    return frame
