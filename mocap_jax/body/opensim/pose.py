"""Between poses q and the coordinates of an OpenSim model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body.coupling import coupled_joints, follow
from mocap_jax.body.model import Body
from mocap_jax.body.opensim.cardan import CardanJoint, cardan_joints
from mocap_jax.body.topology import BALL, FREE, SLIDE
from mocap_jax.errors import unknown_name


@dataclass(frozen=True)
class OpensimCoordinates:
    """Coordinates over time, with the model's own names."""

    names: tuple[str, ...]
    values: Float[np.ndarray, "t n"]
    """[rad, m]"""
    turns: tuple[bool, ...]
    """Whether each is an angle."""


def coordinates_from_poses(body: Body, q: Float[np.ndarray, "t nq"]) -> OpensimCoordinates:
    """Coordinates of a body that was loaded from an OpenSim model; locked ones are not among them.

    Hinges and slides are coordinates as they are, except those that follow others by a function
    within their joint (a knee's secondary turns): these are no coordinates of the model.
    """
    q, topology = np.asarray(q), body.topology
    whole, hidden = cardan_joints(body.xml), {n for n in coupled_joints(body) if "/" in n}
    names: list[str] = []
    columns: list[np.ndarray] = []
    turns: list[bool] = []
    for j, name in enumerate(topology.joint_names):
        at = topology.joint_qpos[j]
        if name in whole:
            R, p = _joint_frame(body, j, q)
            names += whole[name].coordinates
            columns += list(whole[name].values(R, p).T)
            turns += [True] * 3 + [False] * (len(whole[name].coordinates) - 3)
        elif topology.joint_types[j] not in (FREE, BALL) and name not in hidden:
            names.append(name)
            columns.append(q[:, at])
            turns.append(topology.joint_types[j] != SLIDE)
    values = np.stack(columns, axis=1) if columns else np.zeros((len(q), 0))
    return OpensimCoordinates(tuple(names), values, tuple(turns))


def pose_from_coordinates(body: Body, values: Mapping[str, float]) -> Float[np.ndarray, "nq"]:
    """Pose with the given coordinates [rad, m]; others have their default values.

    Raises:
        InputError: the body has no such coordinate.
    """
    topology, q = body.topology, np.array(body.qpos0, float)
    whole = cardan_joints(body.xml)
    of_whole = {name: joint for joint in whole.values() for name in joint.coordinates}
    known = coordinates_from_poses(body, q[None])
    default = dict(zip(known.names, known.values[0], strict=True))
    for name, value in values.items():
        if name not in default:
            raise unknown_name("coordinate", name, known.names)
        if name not in of_whole:
            q[topology.joint_qpos[topology.joint_index(name)]] = value
    for joint in {of_whole[name].joint for name in values if name in of_whole}:
        all_values = np.array([(default | dict(values))[n] for n in whole[joint].coordinates])
        _set_whole(body, q, whole[joint], all_values)
    return np.asarray(follow(body, q))


def _joint_frame(body: Body, j: int, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pose of the child in its parent, of a free or ball joint."""
    at, b = body.topology.joint_qpos[j], body.topology.joint_body[j]
    if body.topology.joint_types[j] == FREE:
        R = Rotation.from_quat(q[:, at + 3 : at + 7], scalar_first=True)
        return R.as_matrix(), q[:, at : at + 3]
    R_rest = Rotation.from_quat(np.asarray(body.body_quat)[b], scalar_first=True)
    R_all = R_rest * Rotation.from_quat(q[:, at : at + 4], scalar_first=True)
    # Only angles are wanted of a ball joint.
    return R_all.as_matrix(), np.zeros((len(q), 3))


def _set_whole(body: Body, q: np.ndarray, joint: CardanJoint, values: np.ndarray) -> None:
    at = body.topology.joint_qpos[body.topology.joint_index(joint.joint)]
    R, p = joint.pose(values)
    if joint.kind == "free":
        q[at : at + 3] = p
        q[at + 3 : at + 7] = Rotation.from_matrix(R).as_quat(scalar_first=True)
        return
    b = body.topology.joint_body[body.topology.joint_index(joint.joint)]
    R_rest = Rotation.from_quat(np.asarray(body.body_quat)[b], scalar_first=True)
    q[at : at + 4] = (R_rest.inv() * Rotation.from_matrix(R)).as_quat(scalar_first=True)
