"""From places on patches to devices of a suit."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.placement.surface import Patch, board_point, outward_at
from mocap_jax.simulation import Mounting, Suit, mount
from mocap_jax.simulation.mounting import with_shapes

_PROBE = "placement_probe"


def mounting_at(patch: Patch, place: np.ndarray) -> Mounting:
    """A board at a place of a patch: z away from the skin, x along the segment's axis."""
    x, y, z = (float(v) for v in board_point(patch, jnp.asarray(place)))
    outward = np.asarray(outward_at(patch, jnp.asarray(place)))
    along = (patch.end - patch.start) / np.linalg.norm(patch.end - patch.start)
    R_segment_board = np.column_stack([along, np.cross(outward, along), outward])
    turn = Rotation.from_matrix(R_segment_board).as_quat(scalar_first=True)
    w, i, j, k = (float(v) for v in turn)
    return Mounting(board_name(patch.segment), patch.segment, (x, y, z), (w, i, j, k))


def board_name(segment: str) -> str:
    """`LeftForeArm` becomes `left_fore_arm`."""
    out = ""
    for i, letter in enumerate(segment):
        out += "_" if letter.isupper() and i and not segment[i - 1].isdigit() else ""
        out += letter.lower()
    return out


def with_probe(body: Body) -> tuple[Body, Body]:
    """The body with shapes, and the same with one site, which the estimator's equations ask for."""
    shaped = with_shapes(body)
    first = shaped.topology.body_names[1]
    return shaped, mount(shaped, Suit((Mounting(_PROBE, first, (0.0, 0.0, 0.0)),)))
