"""Points of the soles that stand on the ground: heel and ball of each foot."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, frames
from mocap_jax.errors import InputError
from mocap_jax.solution.poses import segment_poses

# Foot and toe segments by name: Xsens, OpenSim.
_FEET = (("LeftFoot", "LeftToe"), ("RightFoot", "RightToe"), ("calcn_l", "toes_l"),
         ("calcn_r", "toes_r"))  # fmt: skip
# How far the heel is behind the ankle, relative to how far the ball is in front (both along the
# ground): a quarter to a third (Winter 2009, figure 4.1; de Leva 1996, heel to ball).
_HEEL = 0.3


class Feet(NamedTuple):
    """Points of the soles, fixed to foot segments."""

    bodies: tuple[int, ...]
    """Segment of each point (p,)."""
    points: Float[np.ndarray, "p 3"]
    """Their places in the segment's frame [m]."""

    @property
    def feet(self) -> np.ndarray:
        """Which foot each point belongs to (p,)."""
        return np.unique(self.bodies, return_inverse=True)[1]


def feet_of(body: Body, standing: Float[np.ndarray, "nq"]) -> Feet:
    """Heel and ball of all feet.

    The ball is the joint of the toes. The heel is as high when feet are flat on the ground, a
    little behind the ankle. A foot without toes has its ankle alone.

    Args:
        body: with feet by the names of `segment_names`, or of OpenSim.
        standing: a pose with the feet flat on the ground: the declared rest pose.

    Raises:
        InputError: a body without feet.
    """
    names = body.topology.body_names
    own = [(foot, toe) for foot, toe in _FEET if foot in names]
    if not own:
        valid = ", ".join(foot for foot, _ in _FEET)
        raise InputError(f"contacts: the body has no feet; it needs segments named {valid}")
    f = jax.tree.map(np.asarray, frames(body, jnp.asarray(standing)))
    bodies, points = [], []
    for foot, toe in own:
        b = names.index(foot)
        world = [f.position[b]]
        if toe in names:
            world = list(_sole(f.position[b], f.position[names.index(toe)]))
        bodies += [b] * len(world)
        points += [f.rotation[b].T @ (p - f.position[b]) for p in world]
    return Feet(tuple(bodies), np.array(points))


def _sole(ankle: np.ndarray, ball: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heel and ball in the world."""
    heel = ankle + _HEEL * (ankle - ball)
    heel[2] = ball[2]
    return heel, ball


def positions(body: Body, feet: Feet, q: Float[np.ndarray, "t nq"]) -> Float[np.ndarray, "t p 3"]:
    """World positions of the points in all frames [m]."""
    at = np.array(feet.bodies)
    rotation, position = segment_poses(body, q)
    return position[:, at] + (rotation[:, at] @ feet.points[..., None])[..., 0]
