"""Axis of a hinge, from how two sensors turn against each other; and which joints of a body it is.

Knees and elbows bend far, to one side, about one axis. The relative angular velocity of the sensors
beside such a joint lies along that axis most of the time: its principal direction, in either
sensor's frame. In a pose whose vertical is known the axis then tells where the segment faces, which
gravity does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, coupled_joints
from mocap_jax.body.topology import DOF_WIDTH, HINGE
from mocap_jax.initialise.mounting.joint_heading import WorldMotion

# A hinge that bends mostly one way: its range [rad], and how far its middle is from zero as a share
# of it. Others (wrists, ankles) have no sign to tell.
_BENDS, _ONE_SIDED = np.deg2rad(90.0), 0.35
# What one hinge more between two sensors (pronation behind the elbow) leaves of the share.
_LEAST_SHARE = 0.45
_PARTS = 8
# Turning slower than this tells nothing, in the mean [rad/s].
_LEAST_RATE = 0.15


@dataclass(frozen=True)
class HingeAxis:
    """Axis of a hinge beside which two sensors sit, pointing where bending is positive."""

    joint: str
    in_first: Float[np.ndarray, "3"]
    """Unit vector in the frame of the sensor above."""
    in_second: Float[np.ndarray, "3"]
    """In the frame of the sensor below."""
    share: float
    """Of the relative turning (variance) that is about it: 1 for a perfect hinge."""
    std: float
    """Standard deviation of its direction [rad], from parts of the recording."""
    bends: float
    """Range of the angle about it [rad]."""


def bending_hinge(body: Body, first: int, second: int) -> int | None:
    """The joint between two segments that bends far and one way; None if there is none.

    It has to be the first joint between them, with at most one more axis below it.

    Args:
        body: any.
        first: segment above.
        second: segment below it.
    """
    topology, chain, b = body.topology, [], second
    while b not in (0, first):
        chain.append(b)
        b = topology.body_parent[b]
    if b != first:
        return None
    follow = coupled_joints(body)
    joints = [
        j for b in reversed(chain) for j in topology.joints_of_body(b)
        if topology.joint_names[j] not in follow and topology.joint_types[j] != "slide"
    ]  # fmt: skip
    if not joints or sum(DOF_WIDTH[topology.joint_types[j]] for j in joints) > 2:
        return None
    low, high = np.asarray(body.joint_range)[joints[0]]
    if topology.joint_types[joints[0]] != HINGE or not np.isfinite([low, high]).all():
        return None
    one_sided = abs(low + high) / 2 > _ONE_SIDED * (high - low)
    return joints[0] if high - low > _BENDS and one_sided else None


def hinge_axis(
    body: Body, joint: int, first: WorldMotion, second: WorldMotion, heading: float,
    rest: Float[np.ndarray, "t"], at_rest: float,
) -> HingeAxis | None:  # fmt: skip
    """The axis of a hinge from motion; None where the joint hardly turns, or about many axes.

    Args:
        body: whose joint it is; its range says which way it bends.
        joint: see `bending_hinge`.
        first: motion of the sensor above the joint.
        second: of that below.
        heading: of the second relative to the first (see `joint_heading`).
        rest: which samples are of the pose at rest.
        at_rest: the joint's coordinate in it [rad].
    """
    Z = Rotation.from_euler("z", heading).as_matrix()
    relative = second.rate @ Z.T - first.rate
    known = first.known & second.known
    if np.sqrt((relative[known] ** 2).sum(1).mean()) < _LEAST_RATE:
        return None
    own = first.rotation, Z @ second.rotation
    found = [_principal((R.swapaxes(1, 2) @ relative[..., None])[known, :, 0]) for R in own]
    share = min(share for share, _ in found)
    if max(share for share, _ in found) < _LEAST_SHARE:
        return None
    axis, other = (axis for _, axis in found)
    along = np.einsum("tij,j,tik,k->t", own[0][known], axis, own[1][known], other)
    other = other * (np.sign(along.mean()) or 1.0)  # the two mean one direction
    angle = _bending(own[0][known], own[1][known], axis, rest[known])
    least, most = np.percentile(angle, [1, 99])
    sign = _sign(angle, at_rest, np.asarray(body.joint_range)[joint])
    std = [
        _scatter((R.swapaxes(1, 2) @ relative[..., None])[known, :, 0], a)
        for R, a in zip(own, (axis, other), strict=True)
    ]
    return HingeAxis(
        body.topology.joint_names[joint], sign * axis, sign * other, share, max(std),
        float(most - least),
    )  # fmt: skip


def _sign(angle: np.ndarray, at_rest: float, limits: np.ndarray) -> float:
    """Of the two directions of an axis the one in which the joint stays within its range."""
    outside = [
        (np.maximum(np.maximum(limits[0] - a, a - limits[1]), 0.0) ** 2).mean()
        for a in (at_rest + angle, at_rest - angle)
    ]
    return 1.0 if outside[0] <= outside[1] else -1.0


def _bending(
    first: np.ndarray, second: np.ndarray, axis: np.ndarray, rest: np.ndarray
) -> Float[np.ndarray, "t"]:
    """Angle about an axis of the first sensor's frame, from the pose at rest on [rad]."""
    relative = Rotation.from_matrix(first.swapaxes(1, 2) @ second)
    start = relative[rest].mean() if rest.any() else relative[0]
    quat = (relative * start.inv()).as_quat(scalar_first=True)
    angle = np.unwrap(2 * np.arctan2(quat[:, 1:] @ axis, quat[:, 0]))
    turns = np.median(angle[rest] if rest.any() else angle[:1]) / (2 * np.pi)
    return angle - 2 * np.pi * np.round(turns)


def _principal(rate: np.ndarray) -> tuple[float, np.ndarray]:
    """Share of the variance along the principal direction, and that direction."""
    values, vectors = np.linalg.eigh(rate.T @ rate)
    return float(values[2] / max(values.sum(), 1e-12)), vectors[:, 2]


def _scatter(rate: np.ndarray, axis: np.ndarray) -> float:
    """Standard deviation of a principal direction from parts of the recording that turn most."""
    parts = np.array_split(rate, _PARTS)
    weight = np.array([(p**2).sum() for p in parts])
    axes = np.stack([_principal(p)[1] for p in parts])
    away = np.arccos(np.clip(np.abs(axes @ axis), 0.0, 1.0))
    weight = weight / max(weight.sum(), 1e-12)
    # Parts of unequal weight count as so many equal ones.
    count = 1 / (weight**2).sum()
    return float(np.sqrt((weight * away**2).sum() / max(count, 1.0)))
