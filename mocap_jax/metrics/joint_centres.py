"""Where joints are in the world."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body


def joint_centres(
    body: Body, R: Float[np.ndarray, "t nbody 3 3"], p: Float[np.ndarray, "t nbody 3"]
) -> Float[np.ndarray, "t nbody 3"]:
    """World position [m] of the first joint of every segment (its origin where it has none)."""
    anchor = np.zeros((body.topology.nbody, 3))
    for joint in reversed(range(body.topology.njoint)):
        anchor[body.topology.joint_body[joint]] = np.asarray(body.joint_pos)[joint]
    return p + (R @ anchor[..., None])[..., 0]
