"""Motions as OpenSim's tables: coordinates (MOT, STO) and segment orientations (STO).

Conventions of the files: OpenSim's ground is X forward, Y up, Z right, so that our (x, y, z) is
written (x, z, -y). Angles are in degrees (`inDegrees=yes`), lengths in metres.

- Of a body that was loaded from an OpenSim model, the columns are the model's coordinates; those of
  free and ball joints are recovered from quaternions, without jumps. Locked ones are left out.
- Of any other body they are our joint angles (`RightUpperLeg/flexion`, ...; see
  `solution.angles`), slides by their joint's name, and for a free root `<root>_tilt`, `_list`,
  `_rotation` (Z-X-Y angles of its anatomical frame in the ground) and `<root>_tx`, `_ty`, `_tz`.
- Orientations are `R_ground_segment` as quaternions w,x,y,z, a column for each segment by its name.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.body.opensim import MODEL, R_WORLD_GROUND, coordinates_from_poses
from mocap_jax.body.topology import SLIDE
from mocap_jax.errors import InputError
from mocap_jax.io.world_frames import world_frames
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.angles import joint_angles
from mocap_jax.solution.cardan import cardan_zxy, continuous
from mocap_jax.solution.poses import root_segment
from mocap_jax.trajectory import Trajectory

ORIENTATIONS_SUFFIX = ".orientations.sto"
R_GROUND_WORLD = R_WORLD_GROUND.inv().as_matrix()


def coordinates_text(body: Body, trajectory: Trajectory) -> str:
    """Joint coordinates over time, as MOT or STO text.

    Raises:
        InputError: poses that are not finite.
    """
    q = finite_poses(trajectory, "an OpenSim motion")
    names, columns, turns = _opensim_columns(body, q) if MODEL in body.xml else _columns(body, q)
    values = np.where(turns, np.degrees(columns), columns)
    table = np.concatenate([np.asarray(trajectory.time, float)[:, None], values], axis=1)
    head = [
        "Coordinates", "version=1", f"nRows={len(table)}", f"nColumns={table.shape[1]}",
        "inDegrees=yes", "", "Units are S.I. units (seconds, metres); angles are in degrees.", "",
        "endheader", "\t".join(["time", *("_".join(n.split()) for n in names)]),
    ]  # fmt: skip
    rows = ["\t".join(f"{x:.10g}" for x in row) for row in table.tolist()]
    return "\n".join([*head, *rows]) + "\n"


def _opensim_columns(body: Body, q: np.ndarray) -> tuple[list[str], np.ndarray, np.ndarray]:
    found = coordinates_from_poses(body, q)
    return list(found.names), found.values, np.array(found.turns, bool)


def _columns(body: Body, q: np.ndarray) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names, values [rad, m] and whether each is an angle, of a body of our own."""
    topology = body.topology
    names: list[str] = []
    parts: list[np.ndarray] = []
    turns: list[bool] = []
    if body.has_free_root:
        root = topology.body_names[root_segment(topology)]
        names += [f"{root}_{x}" for x in ("tilt", "list", "rotation", "tx", "ty", "tz")]
        parts += [_root_columns(body, q)]
        turns += [True] * 3 + [False] * 3
    angle_names, angles = joint_angles(body, Trajectory(np.zeros(len(q)), q))
    slides = [j for j, kind in enumerate(topology.joint_types) if kind == SLIDE]
    names += [*angle_names, *(topology.joint_names[j] for j in slides)]
    parts += [angles, q[:, topology.joint_qpos[slides]]]
    turns += [True] * len(angle_names) + [False] * len(slides)
    return names, np.concatenate(parts, axis=1), np.array(turns, bool)


def _root_columns(body: Body, q: np.ndarray) -> np.ndarray:
    """Z-X-Y angles of the root's anatomical frame in the ground, and its position there."""
    root = root_segment(body.topology)
    rotation, origin = world_frames(body, q)
    R = R_GROUND_WORLD @ rotation[:, root] @ anatomical_frames(body)[root]
    return np.hstack([continuous(cardan_zxy(R)), origin[:, root] @ R_GROUND_WORLD.T])


def orientations_text(body: Body, trajectory: Trajectory) -> str:
    """Orientations of all segments in OpenSim's ground, as STO text of quaternions.

    Raises:
        InputError: poses that are not finite.
    """
    q = finite_poses(trajectory, "orientations")
    time = np.asarray(trajectory.time, float)
    rotation, _ = world_frames(body, q)
    names = ["_".join(n.split()) for n in body.topology.body_names[1:]]
    quat = np.stack(
        [
            Rotation.from_matrix(R_GROUND_WORLD @ rotation[:, b]).as_quat(scalar_first=True)
            for b in range(1, body.topology.nbody)
        ],
        axis=1,
    )
    head = [f"DataRate={rate_of(time):.6f}", "DataType=Quaternion", "version=3",
            "OpenSimVersion=4.0", "endheader", "\t".join(["time", *names])]  # fmt: skip
    rows = [
        "\t".join([f"{t:.10g}", *(",".join(f"{x:.12g}" for x in one) for one in frame)])
        for t, frame in zip(time.tolist(), quat.tolist(), strict=True)
    ]
    return "\n".join([*head, *rows]) + "\n"


def finite_poses(trajectory: Trajectory, what: str) -> np.ndarray:
    """Poses (t, nq) of a trajectory.

    Raises:
        InputError: there are none, or they are not finite.
    """
    q = np.asarray(trajectory.q, np.float64)
    if not len(q) or not np.isfinite(q).all():
        raise InputError(f"poses that are not finite, or none, cannot be written as {what}")
    return q


def rate_of(time: np.ndarray) -> float:
    """Mean rate [1/s]; 1 for a single frame."""
    return float((len(time) - 1) / (time[-1] - time[0])) if len(time) > 1 else 1.0
