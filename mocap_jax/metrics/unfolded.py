"""Angles of rotations followed through full turns: 0 to 360 degrees instead of 0 to 180."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax import so3


def unfolded_angles(R: Float[np.ndarray, "t *b 3 3"]) -> Float[np.ndarray, "t *b"]:
    """Angles 2 acos(w) [rad], 0 to 2 pi, of rotations that change continuously over time.

    A rotation has two quaternions, q and -q, of angles that add up to a full turn. The first frame
    takes the one with w >= 0; every later frame the one nearer to the frame before. So an error
    that grows past a half turn goes on growing, as it does in Vlasic 2007, table 1 (means up to
    184 degrees). Between frames the rotation must change by less than a half turn.

    Args:
        R: rotations, for example of an estimate against the truth, frame by frame.
    """
    q = np.array(so3.quat_from_matrix(np.asarray(R)))
    q[0] = np.where(q[0, ..., :1] < 0, -q[0], q[0])
    turned = (q[1:] * q[:-1]).sum(axis=-1) < 0
    sign = np.cumprod(np.where(turned, -1.0, 1.0), axis=0)
    w = np.concatenate([q[:1, ..., 0], sign * q[1:, ..., 0]])
    vector = np.linalg.norm(q[..., 1:], axis=-1)
    return 2 * np.arctan2(vector, w)
