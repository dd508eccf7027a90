"""`Trajectory`: poses over time."""

from __future__ import annotations

from dataclasses import dataclass

import jax
from jax import Array
from jaxtyping import Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Trajectory:
    """Poses of one body over time."""

    time: Float[Array, "t"]
    """Seconds since the recording's start."""
    q: Float[Array, "t nq"]
    """Poses (free joint xyz + wxyz, ball wxyz, hinge rad, slide m)."""
    v: Float[Array, "t nv"] | None = None
    """Velocities in the tangent space, or None."""
