"""What a placement may be judged by: errors of joint centres, or of segments' orientations."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.placement.kinematics import Kinematics

Targets = dict[str, Float[np.ndarray, "j t 3 nv"]]
"""Quantity -> its derivative by the pose, times the root of the frame's share in the mean (zero in
rest hold and blend): `position`, each joint centre's relative to the root's [m]; `orientation`, the
turn of each segment relative to the root segment [rad], as a vector in the world."""


def targets_of(
    body: Body, k: Kinematics, scored: Float[np.ndarray, "t"], chosen: tuple[str, ...]
) -> tuple[tuple[str, ...], Targets]:
    """Joints that count, by the names of their segments, and the derivatives of their quantities.

    Args:
        body: of the study.
        k: its kinematics in a motion.
        scored: which frames count, 1 or 0.
        chosen: joints; empty means all.

    Raises:
        InputError: an unknown joint.
    """
    topology = body.topology
    inner = [b for b in range(1, topology.nbody) if topology.body_parent[b] != 0]
    names = tuple(topology.body_names[b] for b in inner)
    for name in chosen:
        if name not in names:
            raise InputError(f"joints '{name}': unknown; valid: {', '.join(names)}")
    kept = [(b, n) for b, n in zip(inner, names, strict=True) if not chosen or n in chosen]
    root, count = 1, len(scored)
    share = np.sqrt(scored / max(scored.sum(), 1.0))[:, None, None]
    position, angular, linear = (np.asarray(x)[:count] for x in (k.position, k.angular, k.linear))
    anchors = np.zeros((topology.nbody, 3))
    for joint in reversed(range(topology.njoint)):
        anchors[topology.joint_body[joint]] = np.asarray(body.joint_pos)[joint]
    out = {q: np.zeros((len(kept), count, 3, topology.nv)) for q in ("position", "orientation")}

    def turn(b: int) -> np.ndarray:
        return topology.body_dofs[b][None, :, None] * angular

    def move(b: int, at: np.ndarray) -> np.ndarray:
        return topology.body_dofs[b][None, :, None] * (linear + np.cross(angular, at[:, None, :]))

    for i, (b, _) in enumerate(kept):
        at = position[:, b] + np.asarray(k.rotation)[:count, b] @ anchors[b]
        relative = move(b, at) - move(root, position[:, root])
        out["position"][i] = share * np.swapaxes(relative, 1, 2)
        out["orientation"][i] = share * np.swapaxes(turn(b) - turn(root), 1, 2)
    return tuple(n for _, n in kept), out
