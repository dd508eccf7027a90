"""`Kinematics`: what the equations of boards need to know of a motion, wherever the boards are."""

from __future__ import annotations

from dataclasses import dataclass

import jax
from jax import Array
from jaxtyping import Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Kinematics:
    """Frames of t grid times; padded beyond the motion's end, where `present` is 0."""

    rotation: Float[Array, "t b 3 3"]
    position: Float[Array, "t b 3"]
    angular: Float[Array, "t nv 3"]
    linear: Float[Array, "t nv 3"]
    """World screws about the world's origin."""
    rate: Float[Array, "t b 3"]
    """Angular velocity, body frame [rad/s]."""
    force: Float[Array, "t b 3 4"]
    """(c, N): specific force of a point from (1, s), body frame."""
    jerk: Float[Array, "t b 4 4"]
    """Local mean square of its rate of change."""
    turn: Float[Array, "t b"]
    """Local mean of the squared angular acceleration [rad^2/s^4]."""
    spin: Float[Array, "t b"]
    """Local mean of the fourth power of the rate."""
    present: Float[Array, "t"]
    step: Float[Array, ""]
