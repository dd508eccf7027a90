"""How far a site of one body is from the same site of another."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body.model import Body

# Frames of two bodies that differ by less are the same frame [rad].
_SAME = 1e-3


def site_displacement(
    nominal: Body, true: Body, site: str
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]] | None:
    """Shift [m] and turn (rotation vector [rad]) of a site, both in its nominal frame.

    None where one of the bodies lacks the site, or has it on another segment or on one of another
    frame.
    """
    here, there = nominal.topology, true.topology
    if site not in here.site_names or site not in there.site_names:
        return None
    i, j = here.site_index(site), there.site_index(site)
    a, b = here.site_body[i], there.site_body[j]
    if here.body_names[a] != there.body_names[b] or not _same_frame(nominal, a, true, b):
        return None
    turn = _rotation(nominal.site_quat, i).inv()
    shift = turn.apply(np.asarray(true.site_pos)[j] - np.asarray(nominal.site_pos)[i])
    return shift, (turn * _rotation(true.site_quat, j)).as_rotvec()


def _same_frame(nominal: Body, a: int, true: Body, b: int) -> bool:
    """Whether a segment has the same frame in both bodies: its rotation in its parent's."""
    turn = _rotation(nominal.body_quat, a).inv() * _rotation(true.body_quat, b)
    return bool(turn.magnitude() < _SAME)


def _rotation(quaternions: object, i: int) -> Rotation:
    return Rotation.from_quat(np.asarray(quaternions)[i], scalar_first=True)
