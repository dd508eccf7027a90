"""What stands still in the frame of each segment: its geometry, its bones, its sensors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body

# Numbers of MuJoCo's `mjtGeom`.
_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX = 2, 3, 4, 5, 6


@dataclass
class Rounds:
    """Solids of one kind, each about its centre; lengths along their own z."""

    centre: list[Float[np.ndarray, "3"]] = field(default_factory=list)
    """[m]"""
    quaternion: list[Float[np.ndarray, "4"]] = field(default_factory=list)
    """R_segment_solid (xyzw, as Rerun wants it)."""
    size: list[Float[np.ndarray, "3"]] = field(default_factory=list)
    """Half sizes; of capsules and cylinders radius, half length and nothing [m]."""


@dataclass
class SegmentShape:
    """One segment, in its own frame."""

    ellipsoids: Rounds = field(default_factory=Rounds)
    capsules: Rounds = field(default_factory=Rounds)
    cylinders: Rounds = field(default_factory=Rounds)
    boxes: Rounds = field(default_factory=Rounds)
    bones: list[Float[np.ndarray, "2 3"]] = field(default_factory=list)
    """From the origin to the origins of the segments that follow [m]."""
    sites: dict[str, Float[np.ndarray, "3"]] = field(default_factory=dict)
    """Sensors and sources [m]."""


def segment_shapes(body: Body) -> dict[str, SegmentShape]:
    """Shapes of all segments by name; meshes and planes are left out.

    Raises:
        InputError: the body has no MJCF.
    """
    topology, model = body.topology, body.mujoco_model()
    shapes = {name: SegmentShape() for name in topology.body_names[1:]}
    names = topology.body_names
    for i in range(model.ngeom):
        if model.geom_bodyid[i] > 0:
            _add_solid(
                shapes[names[model.geom_bodyid[i]]], int(model.geom_type[i]),
                model.geom_pos[i], np.roll(model.geom_quat[i], -1), model.geom_size[i],
            )  # fmt: skip
    place = np.asarray(body.body_pos)
    for child, parent in enumerate(topology.body_parent):
        if parent > 0:
            shapes[names[parent]].bones.append(np.stack([np.zeros(3), place[child]]))
    for name, where, position in zip(
        topology.site_names, topology.site_body, np.asarray(body.site_pos), strict=True
    ):
        if where > 0:
            shapes[names[where]].sites[name] = position
    return shapes


def _add_solid(
    shape: SegmentShape, kind: int, centre: np.ndarray, quaternion: np.ndarray, size: np.ndarray
) -> None:
    solids = {
        _SPHERE: shape.ellipsoids, _ELLIPSOID: shape.ellipsoids, _CAPSULE: shape.capsules,
        _CYLINDER: shape.cylinders, _BOX: shape.boxes,
    }.get(kind)  # fmt: skip
    if solids is None:
        return
    solids.centre.append(np.array(centre))
    solids.quaternion.append(np.array(quaternion))
    solids.size.append(np.repeat(size[0], 3) if kind == _SPHERE else np.array(size))
