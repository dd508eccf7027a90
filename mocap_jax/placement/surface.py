"""Where on a body a sensor can sit: patches of the segments' surface.

A segment's shape is its capsules and spheres. A patch is seen from an axis through their middle: a
point of it is a share of the axis' length and an angle around it; the surface is where a ray from
the axis leaves the outermost shape. Angles are zero in front (on feet: on top), 90 degrees on the
outside of a limb, on the left of neck and head, on top of pelvis and trunk (whose axis runs from
side to side).
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion import xsens_name
from mocap_jax.simulation.anatomy import Anatomy, anatomy_of

HEIGHT = 0.01
"""Of a board's middle over the skin [m]."""
# Codes of MuJoCo's shapes.
_SPHERE, _CAPSULE = 2, 3
# Reachable parts, by the segment's name without its side: axis, shares of the axis, angles
# [degrees]. Palms, soles, toes, armpits, the insides of thighs and the face are left out.
_REACHABLE: dict[str, tuple[str, tuple[float, float], tuple[float, float]]] = {
    "Pelvis": ("side", (0.2, 0.8), (-30.0, 40.0)),
    "L5": ("side", (0.2, 0.8), (-40.0, 40.0)),
    "L3": ("side", (0.2, 0.8), (-40.0, 40.0)),
    "T12": ("side", (0.2, 0.8), (-40.0, 40.0)),
    "T8": ("side", (0.2, 0.8), (-40.0, 40.0)),
    "Neck": ("along", (0.2, 0.8), (120.0, 240.0)),
    "Head": ("along", (0.5, 0.95), (60.0, 300.0)),
    "Shoulder": ("along", (0.1, 0.8), (20.0, 120.0)),
    "UpperArm": ("along", (0.2, 0.9), (-60.0, 150.0)),
    "ForeArm": ("along", (0.1, 0.95), (-100.0, 200.0)),
    "Hand": ("along", (0.1, 0.6), (45.0, 135.0)),
    "UpperLeg": ("along", (0.25, 0.9), (-40.0, 130.0)),
    "LowerLeg": ("along", (0.1, 0.95), (-100.0, 200.0)),
    "Foot": ("along", (0.2, 0.9), (-60.0, 60.0)),
}


@dataclass(frozen=True)
class Patch:
    """A reachable part of a segment's surface, in the segment's frame."""

    segment: str
    """Its Xsens name, or its own."""
    body: int
    start: Float[np.ndarray, "3"]
    end: Float[np.ndarray, "3"]
    """Ends of the axis."""
    front: Float[np.ndarray, "3"]
    """Where the angle is 0."""
    outside: Float[np.ndarray, "3"]
    """Where it is 90 degrees."""
    capsules: Float[np.ndarray, "k 7"]
    """Both ends and the radius of each."""
    along: tuple[float, float]
    around: tuple[float, float]
    """[rad]"""


def patches_of(body: Body, allowed: tuple[str, ...] = ()) -> tuple[Patch, ...]:
    """Reachable patches of all segments, or of those allowed.

    Args:
        body: with shapes (`simulate` gives bare bodies some).
        allowed: Xsens names or the body's own; empty means all.

    Raises:
        InputError: a segment that does not exist or has no reachable patch; no segment at all.
    """
    anatomy = anatomy_of(body)
    found = {}
    for b, name in enumerate(body.topology.body_names):
        part = xsens_name(name).removeprefix("Left").removeprefix("Right")
        capsules = _capsules(anatomy, b)
        if b and part in _REACHABLE and len(capsules):
            found[xsens_name(name)] = _patch(anatomy, b, xsens_name(name), part, capsules)
    if not found:
        raise InputError("the body has no segment with a known reachable patch (Xsens names)")
    names = {xsens_name(n) for n in allowed}
    for name in names:
        if name not in found:
            raise unknown_name("segment", name, found)
    return tuple(p for name, p in found.items() if not allowed or name in names)


def _capsules(anatomy: Anatomy, b: int) -> np.ndarray:
    model, out = anatomy.model, []
    for geom in np.flatnonzero(model.geom_bodyid == b):
        centre, radius = model.geom_pos[geom], model.geom_size[geom, 0]
        half = np.zeros(3)
        if model.geom_type[geom] == _CAPSULE:
            w, x, y, z = model.geom_quat[geom]
            axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
            half = model.geom_size[geom, 1] * axis
        elif model.geom_type[geom] != _SPHERE:
            continue
        out.append([*(centre - half), *(centre + half), radius])
    return np.array(out).reshape(-1, 7)


def _patch(anatomy: Anatomy, b: int, name: str, part: str, capsules: np.ndarray) -> Patch:
    axis_kind, along, around = _REACHABLE[part]
    turn = anatomy.rotation(b).T
    forward, left, up = (turn @ v for v in (anatomy.forward, anatomy.left, anatomy.up))
    ends = np.concatenate([capsules[:, :3], capsules[:, 3:6]])
    radius = np.tile(capsules[:, 6], 2)
    middle = ends.mean(axis=0)
    axis = left if axis_kind == "side" else _long_axis(part, ends, middle, forward, up)
    reach = (ends - middle) @ axis
    low, high = (reach - radius).min(), (reach + radius).max()
    front = up if abs(axis @ forward) > 0.7 else forward
    front = _unit(front - axis * (axis @ front))
    outside = np.cross(axis, front)
    wanted = -left if name.startswith("Right") else left
    if abs(axis @ left) > 0.7:
        wanted = up
    outside = outside * (1.0 if outside @ wanted >= 0 else -1.0)
    return Patch(
        name, b, middle + low * axis, middle + high * axis, front, outside, capsules, along,
        (float(np.radians(around[0])), float(np.radians(around[1]))),
    )  # fmt: skip


def _long_axis(
    part: str, ends: np.ndarray, middle: np.ndarray, forward: np.ndarray, up: np.ndarray
) -> np.ndarray:
    """Direction in which a segment is longest, away from its joint."""
    if part in ("Head", "Neck"):
        return up
    if part == "Foot":
        return forward
    _, _, directions = np.linalg.svd(ends - middle)
    return directions[0] * (1.0 if directions[0] @ middle >= 0 else -1.0)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


@dataclass(frozen=True)
class Surfaces:
    """Patches of several sensors as arrays, to evaluate and differentiate all at once."""

    patches: tuple[Patch, ...]

    def places(self, free: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
        """Share of the axis and angle [rad] from unbounded coordinates."""
        low, high = self._bounds()
        return low + (high - low) / (1 + jnp.exp(-jnp.asarray(free)))

    def free(self, places: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Unbounded coordinates of places strictly inside their patches."""
        low, high = self._bounds()
        share = np.clip((np.asarray(places) - low) / (high - low), 1e-4, 1 - 1e-4)
        return np.log(share / (1 - share))

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        bounds = np.array([[p.along, p.around] for p in self.patches])
        return bounds[..., 0], bounds[..., 1]

    def points(self, places: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
        """Positions of boards on the patches, segment frames [m]."""
        return jnp.stack([board_point(p, x) for p, x in zip(self.patches, places, strict=True)])


def board_point(patch: Patch, place: Float[Array, "2"]) -> Float[Array, "3"]:
    """Where a board is at a place of its patch [m]."""
    anchor = patch.start + place[0] * (patch.end - patch.start)
    outward = outward_at(patch, place)
    return anchor + (_exit(patch.capsules, anchor, outward) + HEIGHT) * outward


def outward_at(patch: Patch, place: Float[Array, "2"]) -> Float[Array, "3"]:
    """Direction away from the axis at a place."""
    return jnp.cos(place[1]) * patch.front + jnp.sin(place[1]) * patch.outside


def _exit(
    capsules: np.ndarray, anchor: Float[Array, "3"], outward: Float[Array, "3"]
) -> Float[Array, ""]:
    """How far along a ray the outermost capsule ends; 0 where the ray meets none."""
    start, end, radius = capsules[:, :3], capsules[:, 3:6], capsules[:, 6]
    along = end - start
    length = np.linalg.norm(along, axis=1)
    axis = along / np.maximum(length, 1e-9)[:, None]
    from_start = anchor - start
    # Cylinder: the ray's part across the axis.
    across = outward - axis * (axis @ outward)[:, None]
    offset = from_start - axis * (axis * from_start).sum(1)[:, None]
    distance = _far_root((across**2).sum(1), (across * offset).sum(1),
                         (offset**2).sum(1) - radius**2)  # fmt: skip
    height = (axis * (from_start + distance[:, None] * outward)).sum(1)
    side = jnp.where((height >= 0) & (height <= length) & (length > 1e-9), distance, 0.0)
    caps = [
        _far_root(jnp.ones(len(radius)), (d * outward).sum(1), (d**2).sum(1) - radius**2)
        for d in (from_start, anchor - end)
    ]
    return jnp.max(jnp.stack([side, *caps]))


def _far_root(a: Array, b: Array, c: Array) -> Array:
    """Larger root of a x^2 + 2 b x + c, 0 where there is none or it is negative."""
    inside = b * b - a * c
    real = (inside > 1e-12) & (a > 1e-9)
    root = (-b + jnp.sqrt(jnp.where(real, inside, 1.0))) / jnp.where(real, a, 1.0)
    return jnp.where(real & (root > 0), root, 0.0)
