"""`human`: the built-in body, from stature, mass, sex and segment lengths."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion.human.inertia import Lump, segment_lumps
from mocap_jax.motion.human.joints import segment_joints
from mocap_jax.motion.human.lengths import checked_lengths, stretch
from mocap_jax.motion.human.proportions import (
    NEXT,
    PARENT,
    SEXES,
    SIDED,
    Proportions,
    Sex,
    mirrored,
    proportions,
    side_of,
)
from mocap_jax.motion.human.shape import segment_capsules
from mocap_jax.motion.segment_names import XSENS_SEGMENTS
from mocap_jax.motion.skeleton import Bone, Capsule, Inertia, Skeleton, skeleton_body


def human(
    height: float = 1.75,
    mass: float = 70.0,
    sex: Sex | str | None = None,
    lengths: Mapping[str, float] | None = None,
) -> Body:
    """Human body of 23 segments and 56 degrees of freedom, with a free root at `Pelvis`.

    Zero pose: upright on z = 0, arms hanging, palms to the thighs (N-pose), facing X, Y left, Z
    up; all segment frames are then parallel to the world's. Segments bear the 23 Xsens names.

    Ball joints (named as their segment): L5, L3, T12, T8, Neck, Head, shoulders (`*UpperArm`) and
    hips (`*UpperLeg`). Hinges, named `<segment>_<motion>`: clavicle protraction and elevation,
    elbow flexion and pronation, wrist flexion and radial deviation, knee flexion, ankle
    dorsiflexion and inversion, toe extension; positive as named on both sides.

    Lengths: Drillis and Contini 1966; masses and moments of inertia: de Leva 1996; ranges of
    motion: AAOS 1965 (details: docs/human.md and the files beside this one).

    Args:
        height: stature [m], 0.5 to 2.5.
        mass: body mass [kg], 5 to 300; all segments together have exactly this.
        sex: "female", "male" (letters of any case) or None (the mean of both): breadths, upper
            arm, masses.
        lengths: other lengths [m] of some segments, each from its joint to the next along the
            chain (`segment_lengths` lists them). Names are Xsens' ("LeftUpperArm"), or without
            side for both sides ("UpperArm"). Segments without a length here keep stature's
            proportions, so the body's overall height is then no longer `height`; mass and breadths
            stay.

    Raises:
        InputError: a value outside its range, an unknown sex or segment.
    """
    check_size(height, mass)
    sex = checked_sex(sex)
    body = proportions(sex)
    ends = {s: _sided(body.end[side_of(s)[1]], s) * height for s in XSENS_SEGMENTS}
    factors = {s: np.ones(3) for s in XSENS_SEGMENTS}
    if lengths is not None and not isinstance(lengths, Mapping):
        raise InputError(
            f"lengths must map segments to metres, as {{'UpperArm': 0.29}}, got {lengths!r}"
        )
    for segment, length in checked_lengths(lengths or {}, ends).items():
        factors[segment] = np.asarray(stretch(side_of(segment)[1], ends[segment], length))
    lumps = segment_lumps(sex)
    bones = [_bone(s, body, height, factors, mass, lumps) for s in _parents_first()]
    shapes = {
        s: [
            _stretched(c, s, factors[s]) for c in segment_capsules(side_of(s)[1], height, mass, sex)
        ]
        for s in XSENS_SEGMENTS
    }
    return skeleton_body(Skeleton("human", tuple(bones)), shapes)


def check_size(height: float = 1.75, mass: float = 70.0) -> None:
    """Check stature [m] and mass [kg]; raises `InputError` with the valid range."""
    for name, value, unit, (low, high) in (
        ("height", height, "m", (0.5, 2.5)),
        ("mass", mass, "kg", (5.0, 300.0)),
    ):
        if not isinstance(value, (int, float, np.number)) or not low <= value <= high:
            raise InputError(f"{name} must be {low:g} to {high:g} {unit}, got {value!r}")


def checked_sex(sex: str | None) -> Sex | None:
    """One of `SEXES` whatever the case of its letters, or None; raises `InputError` otherwise."""
    if sex is None:
        return None
    for known in SEXES:
        if isinstance(sex, str) and sex.lower() == known:
            return known
    raise unknown_name("sex", str(sex), (*SEXES, "None (the mean of both)"))


def _parents_first() -> list[str]:
    """Segments in the order of the MJCF: the trunk, then right arm and leg, then left ones."""
    middle = [s for s in XSENS_SEGMENTS if side_of(s)[0] == ""]
    return middle + [side + part for side in ("Right", "Left") for part in SIDED]


def _bone(
    segment: str,
    body: Proportions,
    height: float,
    factors: Mapping[str, np.ndarray],
    mass: float,
    lumps: Mapping[str, Lump],
) -> Bone:
    side, part = side_of(segment)
    inertia = _inertia(_sided_lump(lumps[part], side), height, mass, factors[segment])
    end = _sided(body.end[part], segment) * height * factors[segment]
    tip = None if part in NEXT else end
    if part == "Pelvis":
        return Bone(segment, None, np.zeros(3), Rotation.identity(), (), end, inertia, tip)
    parent = side + PARENT[part] if PARENT[part] in SIDED else PARENT[part]
    position = _sided(body.offset[part], segment) * height * factors[parent]
    joints = segment_joints(segment)
    return Bone(segment, parent, position, Rotation.identity(), joints, end, inertia, tip)


def _inertia(lump: Lump, height: float, mass: float, factor: np.ndarray) -> Inertia:
    spread = lump.spread * (height * factor) ** 2
    moments = mass * lump.mass * (spread.sum() - spread)
    return Inertia(mass * lump.mass, lump.centre * height * factor, moments)


def _sided(vector: np.ndarray, segment: str) -> np.ndarray:
    return mirrored(vector, side_of(segment)[0])


def _sided_lump(lump: Lump, side: str) -> Lump:
    return Lump(lump.mass, mirrored(lump.centre, side), lump.spread)


def _stretched(capsule: Capsule, segment: str, factor: np.ndarray) -> Capsule:
    return Capsule(
        _sided(capsule.start, segment) * factor, _sided(capsule.end, segment) * factor,
        capsule.radius,
    )  # fmt: skip
