"""Residuals of a point of the foot that stands on the ground."""

from __future__ import annotations

import jax
from jax import Array
from jaxtyping import Float


def displacement(
    position: Float[Array, "*b 3"], next_position: Float[Array, "*b 3"]
) -> Float[Array, "*b 3"]:
    """How far a standing point moves to the next frame [m]: nowhere (zero velocity)."""
    return next_position - position


def depth(height: Float[Array, "*b"], softness: float | Array) -> Float[Array, "*b"]:
    """Smooth amount by which a point is below the ground [m]; about zero above it.

    Args:
        height: over the ground [m].
        softness: width of the transition [m].
    """
    return softness * jax.nn.softplus(-height / softness)
