"""Motions as BVH text, for animation programs.

Conventions of the file, as its readers expect them: centimetres, degrees, Y up. Our axes (X
forward, Y left, Z up) become X left, Y up, Z forward. There is one joint per body, at the pivot of
the body's joints; at rest (the model's reference pose) all its rotations are zero and its axes
are those of the world, so

    G_b(q) = R_world_b(q) R_world_b(q_rest)^T

turns body b from rest, and the angles written are those of G_parent^T G_b, in the order Z, X, Y
(intrinsic). The root has six channels. So has a joint that also translates in its parent; its
OFFSET is zero, and its position stands in its channels.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.io.world_frames import world_frames
from mocap_jax.trajectory import Trajectory

_CENTIMETRES = 100.0
_R_YUP_ZUP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
# Offsets that change by less are written once, as OFFSET [m].
_FIXED = 1e-7
# Length of the last bone of a limb whose body carries no site [m].
_END_LENGTH = 0.05
_POSITION = "Xposition Yposition Zposition"
_ROTATION = "Zrotation Xrotation Yrotation"


def bvh_text(body: Body, trajectory: Trajectory) -> str:
    """Write a motion as BVH.

    Args:
        body: any body; its bodies become the joints of the hierarchy.
        trajectory: its poses, evenly spaced in time.

    Raises:
        InputError: fewer than two poses, uneven times or poses that are not finite.
    """
    q = np.asarray(trajectory.q, np.float64)
    step = _step(np.asarray(trajectory.time, np.float64))
    if not np.isfinite(q).all():
        raise InputError("poses that are not finite cannot be written as BVH")
    skeleton = _Skeleton(body, np.concatenate([np.asarray(body.qpos0)[None], q]))
    lines = ["HIERARCHY", *skeleton.hierarchy(skeleton.root, 0)]
    lines += ["MOTION", f"Frames: {len(q)}", f"Frame Time: {step:.10g}"]
    values = skeleton.channels()
    row_format = " ".join(["%.6f"] * values.shape[1])
    lines += [row_format % tuple(row) for row in values.tolist()]
    return "\n".join(lines) + "\n"


def _step(time: np.ndarray) -> float:
    if len(time) < 2:
        raise InputError(f"BVH needs at least two poses, not {len(time)}")
    steps = np.diff(time)
    step = float(np.mean(steps))
    if not step > 0 or np.abs(steps - step).max() > 0.01 * step + 1e-6:
        raise InputError("BVH needs evenly spaced times")
    return step


class _Skeleton:
    """Hierarchy and channel values; row 0 of all arrays is the rest pose."""

    def __init__(self, body: Body, q: np.ndarray) -> None:
        topology = body.topology
        rotation, origin = world_frames(body, q)
        R_world_rest = rotation[:1]
        turned = _R_YUP_ZUP @ rotation @ np.swapaxes(R_world_rest, -1, -2) @ _R_YUP_ZUP.T
        pivot = _pivots(body, rotation, origin) @ _R_YUP_ZUP.T
        self._body = body
        self._names = ["_".join(name.split()) for name in topology.body_names]
        self._children = [
            [b for b in range(1, topology.nbody) if topology.body_parent[b] == a]
            for a in range(topology.nbody)
        ]
        # Several bodies on the world need it as their common root.
        self.root = self._children[0][0] if len(self._children[0]) == 1 else 0
        parent = np.array(topology.body_parent)
        G_parent_world = np.swapaxes(turned[:, parent], -1, -2)
        self._local = G_parent_world @ turned
        self._offset = (G_parent_world @ (pivot - pivot[:, parent])[..., None])[..., 0]
        self._local[:, self.root], self._offset[:, self.root] = (
            turned[:, self.root], pivot[:, self.root],
        )  # fmt: skip
        moves = np.abs(self._offset - self._offset[:1]).max(axis=(0, 2)) > _FIXED
        moves[self.root] = True
        self._moves = moves
        self._end = _end_offsets(body, rotation[0], pivot[0], self._offset[0])

    def hierarchy(self, b: int, depth: int) -> list[str]:
        """Lines of a body and all that hangs on it."""
        pad = "  " * depth
        offset = np.zeros(3) if self._moves[b] else self._offset[0, b]
        channels = f"6 {_POSITION} {_ROTATION}" if self._moves[b] else f"3 {_ROTATION}"
        lines = [
            f"{pad}{'ROOT' if b == self.root else 'JOINT'} {self._names[b]}",
            f"{pad}{{",
            f"{pad}  OFFSET {_vector(offset)}",
            f"{pad}  CHANNELS {channels}",
        ]
        for child in self._children[b]:
            lines += self.hierarchy(child, depth + 1)
        if not self._children[b]:
            end = f"{pad}    OFFSET {_vector(self._end[b])}"
            lines += [f"{pad}  End Site", f"{pad}  {{", end, f"{pad}  }}"]
        return [*lines, f"{pad}}}"]

    def channels(self) -> Float[np.ndarray, "t c"]:
        """Values of all channels, in the order of the hierarchy."""
        columns: list[np.ndarray] = []
        self._collect(self.root, columns)
        return np.concatenate(columns, axis=1)

    def _collect(self, b: int, columns: list[np.ndarray]) -> None:
        if self._moves[b]:
            columns.append(self._offset[1:, b] * _CENTIMETRES)
        columns.append(euler_zxy_deg(self._local[1:, b]))
        for child in self._children[b]:
            self._collect(child, columns)


def _vector(metres: np.ndarray) -> str:
    return " ".join(f"{x:.6f}" for x in metres * _CENTIMETRES + 0.0)


def _pivots(body: Body, rotation: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """World position of each body's joints; a body without joints turns about its origin."""
    anchor = np.zeros((body.topology.nbody, 3))
    for b in range(body.topology.nbody):
        joints = body.topology.joints_of_body(b)
        turning = [j for j in joints if body.topology.joint_types[j] in ("hinge", "ball")]
        if turning:
            anchor[b] = np.asarray(body.joint_pos)[turning[-1]]
    return origin + (rotation @ anchor[..., None])[..., 0]


def _end_offsets(
    body: Body, R_world_body: np.ndarray, pivot: np.ndarray, offset: np.ndarray
) -> np.ndarray:
    """End of each body's bone at rest: its farthest site, else a little further along [m, Y up]."""
    length = np.linalg.norm(offset, axis=1, keepdims=True)
    end = np.where(length > 0, offset / np.where(length > 0, length, 1.0), [0, 1, 0]) * _END_LENGTH
    anchors = {b: body.topology.joints_of_body(b) for b in range(body.topology.nbody)}
    best = np.zeros(body.topology.nbody)
    for site, b in enumerate(body.topology.site_body):
        shift = np.asarray(body.site_pos)[site]
        if anchors[b]:
            shift = shift - np.asarray(body.joint_pos)[anchors[b][-1]]
        if (distance := float(np.linalg.norm(shift))) > max(best[b], 1e-3):
            best[b], end[b] = distance, _R_YUP_ZUP @ R_world_body[b] @ shift
    return end


def euler_zxy_deg(R: Float[np.ndarray, "t 3 3"]) -> Float[np.ndarray, "t 3"]:
    """Angles (z, x, y) [deg] with R = Rz Rx Ry, continuous over time.

    In gimbal lock (x at a right angle) the y angle is set to zero.
    """
    cos_x = np.hypot(R[:, 0, 1], R[:, 1, 1])
    x = np.arctan2(R[:, 2, 1], cos_x)
    locked = cos_x < 1e-9
    z = np.where(locked, np.arctan2(R[:, 1, 0], R[:, 0, 0]), np.arctan2(-R[:, 0, 1], R[:, 1, 1]))
    y = np.where(locked, 0.0, np.arctan2(-R[:, 2, 0], R[:, 2, 2]))
    return np.unwrap(np.degrees(np.stack([z, x, y], axis=1)), axis=0, period=360.0)
