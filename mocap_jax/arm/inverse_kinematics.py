"""Two links by Denavit and Hartenberg: forward and inverse (the paper's eq. 2 to 9).

Angles of the planar chain are about the normal of its plane, from the x axis; the base is the
shoulder. A wrist position decides both angles of a planar arm but for the elbow's branch, and
three of the four of an arm with a ball joint: the arm may swivel about the line from shoulder to
wrist, which moves the elbow and nothing else.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from mocap_jax.errors import InputError


def link_transform(
    theta: Float[Array, ""], d: float = 0.0, a: float = 0.0, alpha: float = 0.0
) -> Float[Array, "4 4"]:
    """Transformation between two adjacent links (eq. 2).

    Args:
        theta: joint angle [rad].
        d, a: offset along and length across the joint's axis [m].
        alpha: twist [rad].
    """
    c, s, ca, sa = jnp.cos(theta), jnp.sin(theta), jnp.cos(alpha), jnp.sin(alpha)
    o, one = jnp.zeros_like(c), jnp.ones_like(c)
    return jnp.array([
        [c, -ca * s, sa * s, a * c],
        [s, ca * c, -sa * c, a * s],
        [o, sa * one, ca * one, d * one],
        [o, o, o, one],
    ])  # fmt: skip


def forward(angles: Float[Array, "2"], lengths: tuple[float, float]) -> Float[Array, "4 4"]:
    """Pose of the wrist in the base frame (eq. 3, 4, table I)."""
    return link_transform(angles[0], a=lengths[0]) @ link_transform(angles[1], a=lengths[1])


class PlanarAngles(NamedTuple):
    """Joint angles of a planar arm."""

    shoulder: Float[Array, "t"]
    """Of the upper arm from the x axis [rad], continuous."""
    elbow: Float[Array, "t"]
    """Of the forearm from the upper arm [rad]; its sign is the branch."""
    clamped: Bool[Array, "t"]
    """The wrist is out of reach: the elbow is at full extension or fold, and its angle unknown."""


def planar_angles(
    wrist: Float[Array, "t 2"], lengths: tuple[float, float], branch: float = 1.0,
    one_way: bool = False,
) -> PlanarAngles:  # fmt: skip
    """Joint angles from wrist positions (eq. 7 to 9).

    The argument of the arc cosine is clamped to -1..1. Each frame takes the elbow's branch that is
    nearer to the last frame's angles; where both are as near (straight arm) the branch is kept.

    Args:
        wrist: in the base frame [m].
        lengths: of upper arm and forearm [m].
        branch: sign of the elbow angle before the first frame.
        one_way: keep to that branch, as a human elbow does. The nearer branch may be the wrong one
            after full extension, where noise decides.

    Raises:
        InputError: a length that is not positive.
    """
    _check(lengths)
    l1, l2 = lengths
    x, y = jnp.asarray(wrist)[:, 0], jnp.asarray(wrist)[:, 1]
    cosine = (x * x + y * y - l1**2 - l2**2) / (2 * l1 * l2)
    clamped = jnp.abs(cosine) > 1
    size = jnp.arccos(jnp.clip(cosine, -1.0, 1.0))

    def both(bend: Array, x: Array, y: Array) -> Array:
        along, across = l1 + l2 * jnp.cos(bend), l2 * jnp.sin(bend)
        # Eq. 8 solved for the shoulder; eq. 9 as printed is garbled.
        return jnp.stack([jnp.arctan2(along * y - across * x, along * x + across * y), bend])

    def step(last: Array, inputs: tuple[Array, ...]) -> tuple[Array, Array]:
        size, x, y = inputs
        sign = jnp.where(last[1] < 0, -1.0, 1.0)
        options = jnp.stack([both(sign * size, x, y), both(-sign * size, x, y)])
        turn = options[:, 0] - last[0]
        turn = turn - 2 * jnp.pi * jnp.round(turn / (2 * jnp.pi))
        options = options.at[:, 0].set(last[0] + turn)
        away = ((options - last) ** 2).sum(1)
        # The last angle's sign stands for the branch: a straight arm keeps a trace of it.
        other = (away[1] < away[0] * (1 - 1e-9)) & (not one_way)
        chosen = options[jnp.where(other, 1, 0)]
        sign = jnp.where(chosen[1] == 0, sign, jnp.sign(chosen[1]))
        kept = chosen.at[1].set(sign * jnp.maximum(jnp.abs(chosen[1]), 1e-12))
        return kept, chosen

    first = both(branch * size[0], x[0], y[0]).at[1].set(branch * jnp.maximum(size[0], 1e-12))
    _, angles = jax.lax.scan(step, first, (size, x, y))
    return PlanarAngles(angles[:, 0], angles[:, 1], clamped)


class SpatialArm(NamedTuple):
    """What a wrist position says of an arm with a ball joint at the shoulder."""

    elbow: Float[Array, "t"]
    """Flexion [rad], 0 to pi."""
    direction: Float[Array, "t 3"]
    """From shoulder to wrist, unit length."""
    elbow_centre: Float[Array, "t 3"]
    """Of the circle that the elbow may be on, about `direction` [m]."""
    elbow_radius: Float[Array, "t"]
    """Of that circle [m]: how far the elbow's position is undetermined."""
    elbow_position: Float[Array, "t 3"]
    """On that circle, at the swivel asked for [m]."""
    clamped: Bool[Array, "t"]
    undetermined: str
    """What no wrist position tells, in words."""


def spatial_arm(
    wrist: Float[np.ndarray, "t 3"],
    lengths: tuple[float, float],
    down: Float[np.ndarray, "3"] | tuple[float, float, float] = (0.0, 0.0, -1.0),
    swivel: float = 0.0,
) -> SpatialArm:
    """The part of the inverse kinematics that a wrist position decides, in three dimensions.

    Args:
        wrist: relative to the shoulder [m].
        lengths: of upper arm and forearm [m].
        down: the elbow hangs towards it at swivel 0.
        swivel: angle of the elbow about the line from shoulder to wrist [rad]; it is assumed, not
            found.

    Raises:
        InputError: a length that is not positive.
    """
    _check(lengths)
    l1, l2 = lengths
    wrist = np.asarray(wrist, float)
    reach = np.maximum(np.linalg.norm(wrist, axis=1), 1e-9)
    cosine = (reach**2 - l1**2 - l2**2) / (2 * l1 * l2)
    direction = wrist / reach[:, None]
    inner = np.clip((reach**2 + l1**2 - l2**2) / (2 * reach * l1), -1.0, 1.0)
    centre = (l1 * inner)[:, None] * direction
    radius = l1 * np.sqrt(1 - inner**2)
    first = np.asarray(down, float) - (direction @ np.asarray(down, float))[:, None] * direction
    first = first / np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
    second = np.cross(direction, first)
    elbow = centre + radius[:, None] * (np.cos(swivel) * first + np.sin(swivel) * second)
    return SpatialArm(
        np.arccos(np.clip(cosine, -1.0, 1.0)), direction, centre, radius, elbow,
        np.abs(cosine) > 1,
        "The swivel about the line from shoulder to wrist: the elbow lies anywhere on a circle of "
        f"up to {radius.max():.2f} m radius, and the rotations of upper arm and forearm with it.",
    )  # fmt: skip


def _check(lengths: tuple[float, float]) -> None:
    if not (lengths[0] > 0 and lengths[1] > 0):
        raise InputError(f"lengths={lengths}: both must be above 0 m")
