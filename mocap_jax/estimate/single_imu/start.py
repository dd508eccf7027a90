"""Where the smoothing starts: integrated rates whose tilt follows the mean specific force."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.residuals.preintegration import Increment

# Accelerations of a hand average out over this [s].
_AVERAGE = 3.0
_UP = np.array([0.0, 0.0, 1.0])


def first_orientations(
    increment: Increment, duration: Float[np.ndarray, "k"]
) -> Float[np.ndarray, "k+1 3 3"]:
    """R_world_sensor at the knots, with the first heading as it comes."""
    turns, pushes = np.asarray(increment.rotation), np.asarray(increment.velocity)
    out = np.empty((len(duration) + 1, 3, 3))
    out[0] = _upright(pushes[0])
    mean = np.zeros(3)
    for k, (turn, push) in enumerate(zip(turns, pushes, strict=True)):
        share = max(duration[k] / _AVERAGE, 1 / (k + 1))
        mean = mean + min(share, 1.0) * (out[k] @ push / duration[k] - mean)
        correction = _upright(mean)
        mean = correction @ mean
        out[k + 1] = correction @ out[k] @ turn
    return out


def _upright(force: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The shortest rotation that brings a specific force to the vertical."""
    norm = np.linalg.norm(force)
    if norm == 0:
        return np.eye(3)
    axis = np.cross(force / norm, _UP)
    sine, cosine = np.linalg.norm(axis), force[2] / norm
    if sine < 1e-12:
        return np.eye(3) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    return np.asarray(so3.exp(axis / sine * np.arctan2(sine, cosine)))
