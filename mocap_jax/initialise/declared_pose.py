"""The pose that a recording's set-up declares for its rest hold."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.body.topology import QPOS_WIDTH
from mocap_jax.errors import InputError
from mocap_jax.recording import RestHold


def declared_pose(rest: RestHold | None, body: Body) -> np.ndarray:
    """Pose vector (nq,) of the declared rest pose; joints not named are at the reference pose.

    Raises:
        InputError: a joint is unknown or has the wrong number of coordinates.
    """
    q = np.array(body.qpos0)
    topology = body.topology
    for name, value in (rest.pose if rest else {}).items():
        joint = topology.joint_index(name)
        width = QPOS_WIDTH[topology.joint_types[joint]]
        if len(value) != width:
            kind = topology.joint_types[joint]
            raise InputError(
                f"setup.toml: rest pose of joint '{name}' has {len(value)} coordinates; "
                f"a {kind} joint has {width}"
            )
        at = topology.joint_qpos[joint]
        q[at : at + width] = value
    for quat in topology.quat_index[0]:
        q[quat] /= np.linalg.norm(q[quat])
    return q
