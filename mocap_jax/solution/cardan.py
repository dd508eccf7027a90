"""Z-X-Y Cardan angles of rotations, their second solution, and their continuation over time."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

# Closer to gimbal lock than this, the outer two angles swing too freely to tell the solution [rad].
_PASS = np.deg2rad(5.0)


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
    """Choose, frame after frame, the solution and the turn nearest to the frame before.

    Between two passes through gimbal lock, where the outer angles swing freely, the solution and
    turn nearest to zero are kept: without this a trunk that bends past the lock and back would
    stay half a turn off for the rest of the recording.
    """
    out = np.array(angles, float)
    for k in range(1, len(out)):
        out[k] = nearest_solution(out[k], out[k - 1])
    columns = out.reshape(len(out), -1, 3)
    for c in range(columns.shape[1]):
        columns[:, c] = _settled(columns[:, c])
    return columns.reshape(out.shape)


def _settled(angles: Float[np.ndarray, "t 3"]) -> Float[np.ndarray, "t 3"]:
    """One joint's angles, every stretch between gimbal locks brought near zero."""
    side = np.where(locked(angles, _PASS), 0.0, np.sign(np.cos(angles[:, 1])))
    out = angles.copy()
    for stretch in np.split(np.arange(len(out)), np.flatnonzero(np.diff(side)) + 1):
        if not len(stretch) or side[stretch[0]] == 0.0:
            continue
        piece = out[stretch]
        choices = [x - _whole_turns(x) for x in (piece, other_solution(piece))]
        out[stretch] = min(choices, key=lambda x: np.nanmean(x**2) if np.isfinite(x).any() else 0)
    return out


def _whole_turns(angles: Float[np.ndarray, "t 3"]) -> Float[np.ndarray, "3"]:
    """Turns that bring the middle of a stretch nearest to zero [rad]."""
    finite = angles[np.isfinite(angles).all(axis=1)]
    middle = np.median(finite, axis=0) if len(finite) else np.zeros(3)
    return 2 * np.pi * np.round(middle / (2 * np.pi))


def nearest_solution(
    angles: Float[np.ndarray, "*b 3"], to: Float[np.ndarray, "*b 3"]
) -> Float[np.ndarray, "*b 3"]:
    """The same rotations with the triple (solution and turns) nearest to another triple."""
    first = to + wrap(angles - to)
    second = to + wrap(other_solution(angles) - to)
    closer = np.linalg.norm(first - to, axis=-1) <= np.linalg.norm(second - to, axis=-1)
    # A frame that is not finite must stay so, and not pass on to the next ones as a choice.
    return np.where(closer[..., None], first, second)
