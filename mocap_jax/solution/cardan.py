"""Z-X-Y Cardan angles of rotations, their second solution, and their continuation over time."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def cardan_zxy(R: Float[np.ndarray, "*b 3 3"]) -> Float[np.ndarray, "*b 3"]:
    """Angles (z, x, y) [rad] with R = Rz(z) Rx(x) Ry(y), x between -pi/2 and pi/2.

    This is the sequence of the ISB joint co-ordinate systems (Grood and Suntay 1983): first about
    the parent's Z (flexion axis), last about the child's Y (long axis).
    """
    x = np.arcsin(np.clip(R[..., 2, 1], -1.0, 1.0))
    z = np.arctan2(-R[..., 0, 1], R[..., 1, 1])
    y = np.arctan2(-R[..., 2, 0], R[..., 2, 2])
    return np.stack([z, x, y], axis=-1)


def other_solution(angles: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b 3"]:
    """The other triple of the same rotation: (z + pi, pi - x, y + pi)."""
    z, x, y = np.moveaxis(angles, -1, 0)
    return np.stack([z + np.pi, np.pi - x, y + np.pi], axis=-1)


def locked(angles: Float[np.ndarray, "*b 3"], within: float) -> np.ndarray:
    """Whether the middle angle is closer than `within` [rad] to gimbal lock (a quarter turn).

    There only the sum or difference of the other two means anything.
    """
    return np.abs(np.cos(angles[..., 1])) < np.sin(within)


def wrap(angle: np.ndarray) -> np.ndarray:
    """Bring angles into -pi to pi [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def continuous(angles: Float[np.ndarray, "t *b 3"]) -> Float[np.ndarray, "t *b 3"]:
    """Choose, frame after frame, the solution and the turn nearest to the frame before."""
    out = np.array(angles, float)
    for k in range(1, len(out)):
        out[k] = nearest_solution(out[k], out[k - 1])
    return out


def nearest_solution(
    angles: Float[np.ndarray, "*b 3"], to: Float[np.ndarray, "*b 3"]
) -> Float[np.ndarray, "*b 3"]:
    """The same rotations with the triple (solution and turns) nearest to another triple."""
    first = to + wrap(angles - to)
    second = to + wrap(other_solution(angles) - to)
    closer = np.linalg.norm(first - to, axis=-1) <= np.linalg.norm(second - to, axis=-1)
    # A frame that is not finite must stay so, and not pass on to the next ones as a choice.
    return np.where(closer[..., None], first, second)
