"""Coordinates that follow others (`body.coupling`) are held to their functions.

The body's kinematics takes every coordinate as it is. A stiff residual keeps those that follow,
such as the secondary rotations of an OpenSim knee, within a small fraction of a degree.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body, Piecewise, couplings
from mocap_jax.estimate.sequence.user_residuals import COUPLINGS, UserResidual

# Standard deviation of a coordinate from its function, in each frame [rad, m]: far below what is
# measured, and far above what rounding makes of the normal equations.
_SIGMA = 1e-3


@dataclass(frozen=True)
class _Couplings:
    """`UserResidual.function`: whitened distance of coordinates from what they follow."""

    places: tuple[tuple[int, int, Piecewise], ...]
    """Places in q of a coordinate and of its leader, and the function."""

    def __call__(self, body: Body, q: Float[Array, "1 nq"], data: Any) -> Float[Array, "m"]:
        apart = [q[0][own] - function.at(q[0][leader]) for own, leader, function in self.places]
        return data["root_information"] * jnp.stack(apart)


def coupled_coordinates(body: Body, frames: int) -> tuple[tuple[UserResidual, ...], tuple]:
    """The residual of coordinates that follow others, and its data; empty where there are none."""
    topology = body.topology
    at = {name: int(topology.joint_qpos[j]) for j, name in enumerate(topology.joint_names)}
    places = tuple((at[c.joint], at[c.leader], c.function) for c in couplings(body))
    if not places:
        return (), ()
    data = {"root_information": np.full(frames, 1.0 / _SIGMA)}
    return (UserResidual(COUPLINGS, _Couplings(places)),), (data,)
