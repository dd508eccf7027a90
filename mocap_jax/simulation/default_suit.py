"""The standard suit: 18 boards and 8 sources after Vlasic 2007, fitted to any human body.

The paper gives no list of places. Ours: boards on pelvis, abdomen, chest, head and on both
shoulders, upper arms, forearms, hands, thighs, shanks and feet; seven sources on chest and belly
pointing forward (fanned sideways and tilted down, so that they hear arms and legs), the eighth on
the brim of a hat pointing down; the head's board is on that brim as well. Devices sit on the
surface of the body's own shapes.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion import segment_tip
from mocap_jax.simulation.anatomy import Anatomy, anatomy_of
from mocap_jax.simulation.suit import Mounting, Suit

# Height over the skin of boards and of sources (on plates over a garment) [m], and how far the
# board and the source on the hat's brim stand out from the forehead [m].
_BOARD_HEIGHT = 0.01
_SOURCE_HEIGHT = 0.02
_BRIM_BOARD, _BRIM = 0.08, 0.13
# Segments shorter than the first have no direction of their own; they count as the second [m].
_POINT, _STUB = 0.005, 0.1
_TRUNK_SEGMENTS = ("T8", "T12", "L3", "L5", "Pelvis")


@dataclass(frozen=True)
class _TrunkPlace:
    """On the trunk: level from hips (0) to neck (1); angles in degrees."""

    name: str
    segments: tuple[str, ...]
    """The best first."""
    level: float
    place: float
    """Where around the trunk: from the front to the left."""
    aim: float
    """Where the device's z axis points: from the front to the left."""
    tilt: float = 0.0
    """How far down it points."""


@dataclass(frozen=True)
class _LimbPlace:
    """On a segment: share of its length, and weights of front, outside and top of the limb."""

    name: str
    segment: str
    along: float
    front: float
    outside: float
    top: float = 0.0


_CHEST = ("T8", "T12", "L3", "L5", "Pelvis")
_BELLY = ("L3", "L5", "T12", "Pelvis", "T8")
_TRUNK_BOARDS = (
    _TrunkPlace("pelvis", ("Pelvis", "L5"), 0.05, 0.0, 0.0),
    _TrunkPlace("abdomen", ("L5", "L3", "Pelvis", "T12", "T8"), 0.32, 0.0, 0.0),
    _TrunkPlace("chest", _CHEST, 0.62, 0.0, 0.0),
)
_TRUNK_SOURCES = (
    _TrunkPlace("chest_left", _CHEST, 0.78, 55.0, 30.0, 20.0),
    _TrunkPlace("chest_right", _CHEST, 0.78, -55.0, -30.0, 20.0),
    _TrunkPlace("chest_top", _CHEST, 0.82, 0.0, 0.0, 0.0),
    _TrunkPlace("belly_left", _BELLY, 0.40, 60.0, 35.0, 30.0),
    _TrunkPlace("belly_right", _BELLY, 0.40, -60.0, -35.0, 30.0),
    _TrunkPlace("belly_top", _BELLY, 0.46, 0.0, 0.0, 15.0),
    _TrunkPlace("belly_low", _BELLY, 0.25, 0.0, 0.0, 30.0),
)
_LIMB_BOARDS = (
    _LimbPlace("shoulder", "Shoulder", 0.6, 0.9, 0.0, 0.45),
    _LimbPlace("upper_arm", "UpperArm", 0.6, 1.0, 0.2),
    _LimbPlace("forearm", "ForeArm", 0.75, 1.0, 0.3),
    _LimbPlace("hand", "Hand", 0.5, 0.8, 0.6),
    _LimbPlace("thigh", "UpperLeg", 0.55, 1.0, 0.3),
    _LimbPlace("shank", "LowerLeg", 0.7, 1.0, 0.7),
    _LimbPlace("foot", "Foot", 0.8, 0.0, 0.0, 1.0),
)
_DISTAL = {
    "Neck": "Head", "Shoulder": "UpperArm", "UpperArm": "ForeArm", "ForeArm": "Hand",
    "UpperLeg": "LowerLeg", "LowerLeg": "Foot", "Foot": "Toe",
}  # fmt: skip


def default_suit(body: Body) -> Suit:
    """The 18 boards and 8 sources, placed on the surface of a body's shapes.

    Works for any body whose segments carry Xsens, CMU or dm_control names. Trunk devices whose
    segment is missing go to the nearest trunk segment; other devices without a segment are left
    out and named in `Suit.omitted`.

    Raises:
        InputError: the body has no trunk segment at all (mount a suit of your own).
    """
    anatomy = anatomy_of(body)
    if not any(s in anatomy.segments for s in _TRUNK_SEGMENTS):
        raise InputError(
            "the default suit needs a human body with Xsens, CMU or dm_control segment names; "
            "give a set-up file with boards on the segments "
            + ", ".join(body.topology.body_names[1:])
        )
    boards = [_on_trunk(anatomy, place, _BOARD_HEIGHT) for place in _TRUNK_BOARDS]
    sources = [_on_trunk(anatomy, place, _SOURCE_HEIGHT) for place in _TRUNK_SOURCES]
    omitted = []
    if "Head" in anatomy.segments:
        boards.append(_on_hat(anatomy, "head", _BRIM_BOARD, 1.0))
        sources.append(_on_hat(anatomy, "hat", _BRIM, -1.0))
    else:
        omitted += ["board head: no segment Head", "source hat: no segment Head"]
    for place in _LIMB_BOARDS:
        for side in ("Left", "Right"):
            name, segment = f"{side.lower()}_{place.name}", side + place.segment
            if segment in anatomy.segments:
                boards.append(_on_limb(anatomy, place, name, segment))
            else:
                omitted.append(f"board {name}: no segment {segment}")
    return Suit(tuple(boards), tuple(sources), tuple(omitted))


def _on_trunk(anatomy: Anatomy, place: _TrunkPlace, height: float) -> Mounting:
    bottom, top = _trunk_axis(anatomy)
    around = lambda angle: (  # noqa: E731
        np.cos(np.radians(angle)) * anatomy.forward + np.sin(np.radians(angle)) * anatomy.left
    )
    outward, tilt = around(place.place), np.radians(place.tilt)
    anchor = bottom + place.level * (top - bottom)
    point = _surface(anatomy, _trunk_bodies(anatomy), anchor, outward) + height * outward
    axis = np.cos(tilt) * around(place.aim) - np.sin(tilt) * anatomy.up
    segment = next(s for s in (*place.segments, *_TRUNK_SEGMENTS) if s in anatomy.segments)
    return _mounting(anatomy, place.name, segment, point, axis, -anatomy.up)


def _trunk_axis(anatomy: Anatomy) -> tuple[np.ndarray, np.ndarray]:
    """Middle of the hips and base of the neck (or the highest that exists)."""
    present = lambda *names: [n for n in names if n in anatomy.segments]  # noqa: E731
    lowest, highest = present(*reversed(_TRUNK_SEGMENTS))[:1], present(*_TRUNK_SEGMENTS)[:1]
    hips = present("LeftUpperLeg", "RightUpperLeg") or lowest
    top = present("Neck") or present("LeftUpperArm", "RightUpperArm") or present("Head") or highest
    return (
        np.mean([anatomy.position(n) for n in hips], axis=0),
        np.mean([anatomy.position(n) for n in top], axis=0),
    )


def _trunk_bodies(anatomy: Anatomy) -> set[int]:
    """Bodies of the trunk: all but the subtrees of legs, arms, neck and head."""
    ends = ("UpperLeg", "UpperArm")
    outside = {
        anatomy.segments[n]
        for n in (*(s + e for s in ("Left", "Right") for e in ends), "Neck", "Head")
        if n in anatomy.segments
    }
    trunk: set[int] = set()
    for b in range(1, anatomy.model.nbody):
        if anatomy.model.body_parentid[b] in outside:
            outside.add(b)
        if b not in outside:
            trunk.add(b)
    return trunk


def _on_limb(anatomy: Anatomy, place: _LimbPlace, name: str, segment: str) -> Mounting:
    start, end = _ends(anatomy, segment)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    # The outside of a limb turns with it: lateral for a hanging arm, up for one held sideways.
    outside = np.cross(anatomy.forward, along) * (-1.0 if segment.startswith("Right") else 1.0)
    outward = place.front * anatomy.forward + place.outside * outside + place.top * anatomy.up
    outward = outward - along * (along @ outward)
    outward = outward / np.linalg.norm(outward)
    anchor = start + place.along * (end - start)
    own = {anatomy.segments[segment]}
    point = _surface(anatomy, own, anchor, outward) + _BOARD_HEIGHT * outward
    return _mounting(anatomy, name, segment, point, outward, along)


def _on_hat(anatomy: Anatomy, name: str, reach: float, upwards: float) -> Mounting:
    """On the brim, `reach` in front of the forehead, facing up (1) or down (-1)."""
    start, end = _ends(anatomy, "Head")
    anchor = start + 0.75 * (end - start)
    own = {anatomy.segments["Head"]}
    point = _surface(anatomy, own, anchor, anatomy.forward) + reach * anatomy.forward
    point = point + upwards * _BOARD_HEIGHT * anatomy.up
    return _mounting(anatomy, name, "Head", point, upwards * anatomy.up, anatomy.forward)


def _ends(anatomy: Anatomy, segment: str) -> tuple[np.ndarray, np.ndarray]:
    """Proximal and distal end of a segment in world coordinates."""
    start = anatomy.position(segment)
    side = next((s for s in ("Left", "Right") if segment.startswith(s)), "")
    distal = side + _DISTAL.get(segment.removeprefix(side), "")
    if distal != side and distal in anatomy.segments:
        # Skeletons may have a joint in between (CMU: the wrist before the hand).
        child = anatomy.segments[distal]
        while anatomy.model.body_parentid[child] not in (anatomy.segments[segment], 0):
            child = anatomy.model.body_parentid[child]
        if anatomy.model.body_parentid[child]:
            return start, anatomy.data.xpos[child]
    if (tip := segment_tip(anatomy.model, segment)) is not None:
        return start, start + anatomy.rotation(anatomy.segments[segment]) @ tip
    own = np.flatnonzero(anatomy.model.geom_bodyid == anatomy.segments[segment])
    if own.size:
        # A shape's centre lies half-way along its segment.
        half = anatomy.data.geom_xpos[own].mean(axis=0) - start
        if np.linalg.norm(half) > _POINT:
            return start, start + 2.0 * half
    # A segment without extent goes on in the direction of its parent.
    before = start - anatomy.data.xpos[anatomy.model.body_parentid[anatomy.segments[segment]]]
    length = float(np.linalg.norm(before))
    onwards = before / length if length > _POINT and segment != "Head" else anatomy.up
    return start, start + _STUB * onwards


def _surface(
    anatomy: Anatomy, bodies: set[int], anchor: np.ndarray, outward: np.ndarray
) -> np.ndarray:
    """Where the outermost shape of some bodies ends, seen from the anchor along a direction."""
    model, data = anatomy.model, anatomy.data
    far = 1.0
    origin = anchor + far * outward
    nearest = np.inf
    for geom in range(model.ngeom):
        kind = model.geom_type[geom]
        if model.geom_bodyid[geom] not in bodies or kind in _NOT_PLAIN:
            continue
        distance = mujoco.mju_rayGeom(
            data.geom_xpos[geom], data.geom_xmat[geom], model.geom_size[geom], origin, -outward,
            kind,
        )  # fmt: skip
        if distance >= 0:
            nearest = min(nearest, distance)
    return origin - outward * min(nearest, far)


_NOT_PLAIN = (
    mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF,
    mujoco.mjtGeom.mjGEOM_PLANE,
)  # fmt: skip


def _mounting(
    anatomy: Anatomy,
    name: str,
    segment: str,
    point: np.ndarray,
    axis: np.ndarray,
    along: np.ndarray,
) -> Mounting:
    """Device at a world point of the reference pose: z along `axis`, x towards `along`."""
    body = anatomy.segments[segment]
    z = axis / np.linalg.norm(axis)
    x = along - z * (z @ along)
    x = x / np.linalg.norm(x)
    R_segment_world = anatomy.rotation(body).T
    R_world_device = np.column_stack([x, np.cross(z, x), z])
    orientation = Rotation.from_matrix(R_segment_world @ R_world_device).as_quat(scalar_first=True)
    position = R_segment_world @ (point - anatomy.data.xpos[body])
    own_name = mujoco.mj_id2name(anatomy.model, mujoco.mjtObj.mjOBJ_BODY, body)
    px, py, pz = map(float, position)
    w, x_, y_, z_ = map(float, orientation)
    return Mounting(name, own_name, (px, py, pz), (w, x_, y_, z_))
