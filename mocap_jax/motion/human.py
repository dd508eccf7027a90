"""A first human body from published proportions.

Zero pose: upright, arms hanging, palms to the thighs (N-pose), facing X, Y left, Z up; all segment
frames are then parallel to the world's. Segments bear the 23 Xsens names.

Sources:
    lengths: Drillis and Contini 1966, as fractions of stature in Winter 2009, figure 4.1; the
        trunk's division at L5/S1, L4/L3, T12/L1, T9/T8, C7/T1 and C1 by mean vertebral heights.
    masses: Winter 2009, table 4.1 (trunk parts and toes divided by volume).
    ranges of motion: American Academy of Orthopaedic Surgeons (1965) for limbs, Kapandji for
        clavicle and spine. A ball joint's single limit is its largest excursion.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion.skeleton import Bone, Capsule, Joint, Skeleton, skeleton_body

# Offsets of each joint from its parent's [fractions of stature]; Y is for the left side.
_MIDDLE_OFFSETS = {
    "L5": ("Pelvis", (-0.010, 0.0, 0.055)),
    "L3": ("L5", (0.0, 0.0, 0.042)),
    "T12": ("L3", (0.0, 0.0, 0.058)),
    "T8": ("T12", (0.0, 0.0, 0.055)),
    "Neck": ("T8", (0.0, 0.0, 0.100)),
    "Head": ("Neck", (0.005, 0.0, 0.060)),
}
_SIDED_OFFSETS = {
    "Shoulder": ("T8", (0.0, 0.015, 0.085)),
    "UpperArm": ("Shoulder", (0.0, 0.100, -0.007)),
    "ForeArm": ("UpperArm", (0.0, 0.0, -0.186)),
    "Hand": ("ForeArm", (0.0, 0.0, -0.146)),
    "UpperLeg": ("Pelvis", (0.0, 0.049, 0.0)),
    "LowerLeg": ("UpperLeg", (0.0, 0.0, -0.245)),
    "Foot": ("LowerLeg", (0.0, 0.0, -0.246)),
    "Toe": ("Foot", (0.080, 0.0, -0.028)),
}
_MASS = {
    "Pelvis": 0.142, "L5": 0.069, "L3": 0.070, "T12": 0.070, "T8": 0.116, "Neck": 0.017,
    "Head": 0.064, "Shoulder": 0.015, "UpperArm": 0.028, "ForeArm": 0.016, "Hand": 0.006,
    "UpperLeg": 0.100, "LowerLeg": 0.0465, "Foot": 0.0120, "Toe": 0.0025,
}  # fmt: skip
"""Fractions of body mass; sided ones count twice and all sum to one."""

_BALL_LIMIT = {"L5": 25, "L3": 25, "T12": 20, "T8": 20, "Neck": 40, "Head": 40, "UpperLeg": 125}
"""Largest excursion [deg]; the shoulder reaches half a turn, so it has none."""

# Hinges of one segment, outer first: name, axis of positive turns on the left side, range [deg].
_HINGES = {
    "Shoulder": (("protraction", (0, 0, -1), (-25, 30)), ("elevation", (1, 0, 0), (-10, 40))),
    "ForeArm": (("flexion", (0, -1, 0), (-5, 150)), ("pronation", (0, 0, -1), (-80, 80))),
    "Hand": (("flexion", (-1, 0, 0), (-70, 80)), ("radial_deviation", (0, -1, 0), (-30, 20))),
    "LowerLeg": (("flexion", (0, 1, 0), (-10, 140)),),
    "Foot": (("dorsiflexion", (0, -1, 0), (-50, 25)), ("inversion", (-1, 0, 0), (-20, 35))),
    "Toe": (("extension", (0, -1, 0), (-40, 70)),),
}

# Capsules of each segment, left side: both ends [fractions of stature], radius [m] for 70 kg and
# 1.75 m (rounded from NASA-STD-3000 volume I, section 3).
_CAPSULES = {
    "Pelvis": (((-0.01, 0.034, 0.022), (-0.01, -0.034, 0.022), 0.105),),
    "L5": (((0, 0.028, 0.022), (0, -0.028, 0.022), 0.10),),
    "L3": (((0, 0.028, 0.029), (0, -0.028, 0.029), 0.10),),
    "T12": (((0, 0.030, 0.028), (0, -0.030, 0.028), 0.105),),
    "T8": (((0, 0.028, 0.020), (0, -0.028, 0.020), 0.11),
           ((-0.005, 0.042, 0.055), (-0.005, -0.042, 0.055), 0.08)),
    "Neck": (((0, 0, 0), (0.005, 0, 0.06), 0.055),),
    "Head": (((0, 0, 0.036), (0.020, 0, 0.054), 0.08),),
    "Shoulder": (((0, 0, 0), (0, 0.095, -0.007), 0.04),),
    "UpperArm": (((0, 0, 0), (0, 0, -0.186), 0.045),),
    "ForeArm": (((0, 0, 0), (0, 0, -0.146), 0.035),),
    "Hand": (((0.010, 0, -0.010), (0.008, 0, -0.098), 0.017),
             ((-0.010, 0, -0.010), (-0.008, 0, -0.098), 0.017)),
    "UpperLeg": (((0, 0, 0), (0, 0, -0.245), 0.07),),
    "LowerLeg": (((0, 0, 0), (0, 0, -0.246), 0.05),),
    "Foot": (((-0.022, 0.008, -0.0218), (0.068, 0.012, -0.0218), 0.03),
             ((-0.022, -0.008, -0.0218), (0.068, -0.012, -0.0218), 0.03)),
    "Toe": (((0, 0.012, 0), (0.032, 0.010, 0), 0.02), ((0, -0.012, 0), (0.032, -0.010, 0), 0.02)),
}  # fmt: skip


def human(height: float = 1.75, mass: float = 70.0) -> Body:
    """Human body of 23 segments and 56 degrees of freedom, with a free root at `Pelvis`.

    Ball joints (named as their segment): L5, L3, T12, T8, Neck, Head, shoulders (`*UpperArm`) and
    hips (`*UpperLeg`). Hinges, named `<segment>_<motion>`: clavicle protraction and elevation,
    elbow flexion and pronation, wrist flexion and radial deviation, knee flexion, ankle
    dorsiflexion and inversion, toe extension; positive as named on both sides.

    Args:
        height: stature [m], 0.5 to 2.5.
        mass: body mass [kg], 5 to 300; thickness follows from both.

    Raises:
        InputError: a value outside its range.
    """
    for name, value, unit, (low, high) in (
        ("height", height, "m", (0.5, 2.5)),
        ("mass", mass, "kg", (5.0, 300.0)),
    ):
        if not low <= value <= high:
            raise InputError(f"{name} must be {low:g} to {high:g} {unit}, got {value}")
    bones = [Bone("Pelvis", None, np.zeros(3), Rotation.identity())]
    for name, (parent, offset) in _MIDDLE_OFFSETS.items():
        bones.append(_bone(name, parent, np.array(offset) * height, ""))
    for side in ("Right", "Left"):
        for name, (parent, offset) in _SIDED_OFFSETS.items():
            parent = side + parent if parent in _SIDED_OFFSETS else parent
            bones.append(_bone(name, parent, np.array(offset) * height, side))
    thickness = math.sqrt(mass / height / (70.0 / 1.75))
    shapes = {bone.name: _capsules(bone.name, height, mass, thickness) for bone in bones}
    return skeleton_body(Skeleton("human", tuple(bones)), shapes)


def _bone(name: str, parent: str, offset: np.ndarray, side: str) -> Bone:
    position = _mirrored(offset, side)
    segment = side + name
    if name not in _HINGES:
        limit = _BALL_LIMIT.get(name)
        joints = (Joint(segment, None, (0.0, math.radians(limit)) if limit else None),)
        return Bone(segment, parent, position, Rotation.identity(), joints)
    # An axis is a pseudovector: reflection in the mid-plane keeps Y and reverses X and Z.
    flip = -1.0 if side == "Right" else 1.0
    hinges = tuple(
        Joint(
            f"{segment}_{motion}",
            (flip * x, 1.0 * y, flip * z),
            (math.radians(low), math.radians(high)),
        )
        for motion, (x, y, z), (low, high) in _HINGES[name]
    )
    return Bone(segment, parent, position, Rotation.identity(), hinges)


def _mirrored(vector: np.ndarray, side: str) -> np.ndarray:
    """A left side's vector on the given side."""
    return vector * ([1.0, -1.0, 1.0] if side == "Right" else [1.0, 1.0, 1.0])


def _capsules(segment: str, height: float, mass: float, thickness: float) -> list[Capsule]:
    side = next((s for s in ("Right", "Left") if segment.startswith(s)), "")
    name = segment.removeprefix(side)
    parts = _CAPSULES[name]
    # Soles must stay on one level whatever the thickness: feet scale with stature alone.
    factor = height / 1.75 if name in ("Foot", "Toe") else thickness
    return [
        Capsule(
            _mirrored(np.array(start) * height, side),
            _mirrored(np.array(end) * height, side),
            radius * factor,
            mass * _MASS[name] / len(parts),
        )
        for start, end, radius in parts
    ]
