"""Capsules that look like a person: for occlusion, for placing devices on the skin, for pictures.

Sizes are fractions of stature for a body of 70 kg and 1.75 m; thickness of all but head, hands and
feet grows with the root of mass over height. Overall breadths follow Winter 2009, figure 4.1
(hips 0.191, foot length 0.152), the rest is our choice; the sexes differ in shoulders, chest,
waist, hips and limb girths.
"""

from __future__ import annotations

import math

import numpy as np

from mocap_jax.motion.human.proportions import Sex, of_sex
from mocap_jax.motion.skeleton import Capsule

Triple = tuple[float, float, float]

# Rings of the pelvis, capsules from left to right: (height above the joint, how far forward of it),
# then half breadth and radius (female, male).
_RINGS = (
    ((-0.010, -0.008), ((0.098, 0.060), (0.091, 0.058))),
    ((0.014, -0.009), ((0.100, 0.063), (0.094, 0.061))),
    ((0.038, -0.004), ((0.092, 0.059), (0.090, 0.060))),
)
# Upright capsules of the trunk, a middle one and one on either side: (lower and upper end, how far
# forward), then half breadth below and above, and radius (female, male).
_COLUMNS = {
    "L5": ((-0.004, 0.042, 0.009), ((0.084, 0.072, 0.054), (0.087, 0.080, 0.058))),
    "L3": ((0.0, 0.058, 0.010), ((0.071, 0.072, 0.052), (0.079, 0.083, 0.058))),
    "T12": ((0.0, 0.063, 0.011), ((0.072, 0.080, 0.053), (0.083, 0.094, 0.059))),
    "T8": ((0.0, 0.040, 0.012), ((0.080, 0.081, 0.055), (0.094, 0.097, 0.061))),
}
# Other capsules: both ends, radius (female, male).
_CAPSULES: dict[str, tuple[tuple[Triple, Triple, tuple[float, float]], ...]] = {
    "T8": (  # slope of the shoulders
        ((0.0, 0.012, 0.092), (0.002, 0.070, 0.056), (0.026, 0.030)),
        ((0.0, -0.012, 0.092), (0.002, -0.070, 0.056), (0.026, 0.030)),
    ),
    "Neck": (((0.0, 0.0, -0.010), (0.006, 0.0, 0.055), (0.028, 0.033)),),
    "Head": (  # skull, face, nose
        ((-0.007, 0.0, 0.0435), (0.014, 0.0, 0.0435), (0.0435, 0.0435)),
        ((0.013, 0.0, 0.040), (0.019, 0.0, -0.007), (0.036, 0.037)),
        ((0.050, 0.0, 0.028), (0.057, 0.0, 0.014), (0.0065, 0.0065)),
    ),
    "Shoulder": (((-0.008, 0.030, 0.0), (-0.012, 0.090, -0.020), (0.024, 0.028)),),
    "UpperArm": (  # deltoid; biceps and triceps, which meet at the elbow
        ((0.0, 0.0, 0.0), (0.0, 0.002, -0.040), (0.0265, 0.0315)),
        ((0.007, 0.0, -0.030), (0.001, 0.0, -0.1602), (0.0195, 0.0225)),
        ((-0.007, 0.0, -0.030), (-0.001, 0.0, -0.1602), (0.0195, 0.0225)),
    ),
    "ForeArm": (
        ((0.008, 0.0, -0.018), (0.003, 0.0, -0.144), (0.0140, 0.0160)),
        ((-0.008, 0.0, -0.018), (-0.003, 0.0, -0.144), (0.0140, 0.0160)),
        ((0.0, 0.007, -0.024), (0.0, 0.0, -0.100), (0.0145, 0.0170)),
    ),
    "Hand": (  # palm and fingers, index finger in front; thumb
        ((0.013, 0.0, -0.006), (0.013, 0.0, -0.093), (0.0080, 0.0088)),
        ((0.0, 0.0, -0.006), (0.0, 0.0, -0.0992), (0.0080, 0.0088)),
        ((-0.013, 0.0, -0.008), (-0.013, 0.0, -0.087), (0.0075, 0.0082)),
        ((0.014, 0.0, -0.014), (0.028, -0.004, -0.046), (0.0075, 0.0082)),
    ),
    "UpperLeg": (  # four that meet at the knee
        ((0.0, 0.014, -0.004), (0.0, 0.003, -0.240), (0.0325, 0.0305)),
        ((0.0, -0.014, -0.026), (0.0, -0.003, -0.240), (0.0315, 0.0295)),
        ((0.014, 0.002, -0.010), (0.002, 0.0, -0.242), (0.0310, 0.0310)),
        ((-0.018, 0.002, -0.010), (-0.002, 0.0, -0.240), (0.0325, 0.0305)),
    ),
    "LowerLeg": (  # shin, both bellies of the calf
        ((0.004, 0.0, -0.002), (0.0, 0.0, -0.2440), (0.0215, 0.0220)),
        ((-0.008, 0.007, -0.028), (-0.001, 0.001, -0.2000), (0.0230, 0.0240)),
        ((-0.008, -0.008, -0.028), (-0.001, -0.001, -0.2000), (0.0230, 0.0240)),
        ((-0.012, 0.0, -0.050), (-0.010, 0.0, -0.1000), (0.0220, 0.0240)),
    ),
    "Foot": (  # outer and inner edge of the sole, instep
        ((-0.0225, 0.004, -0.0245), (0.068, 0.014, -0.0245), (0.0145, 0.0145)),
        ((-0.0225, -0.004, -0.0245), (0.068, -0.014, -0.0245), (0.0145, 0.0145)),
        ((-0.002, 0.0, -0.006), (0.058, -0.003, -0.024), (0.0150, 0.0150)),
    ),
    "Toe": (
        ((0.0, 0.015, 0.0), (0.025, 0.012, 0.0), (0.0110, 0.0110)),
        ((0.0, 0.0, 0.0), (0.029, 0.0, 0.0), (0.0110, 0.0110)),
        ((0.0, -0.015, 0.0), (0.028, -0.012, 0.0), (0.0110, 0.0110)),
    ),
}
_BUST = ((0.042, 0.034, 0.024), 0.032)
_SAME_FOR_ALL = ("Head", "Hand", "Foot", "Toe")  # soles stay level, whatever the mass


def segment_capsules(part: str, height: float, mass: float, sex: Sex | None) -> list[Capsule]:
    """Capsules [m] of a segment of the left side, by its name without side."""
    thickness = 1.0 if part in _SAME_FOR_ALL else math.sqrt(mass / height / (70.0 / 1.75))
    capsules = _trunk(part, height, thickness, sex)
    for start, end, radii in _CAPSULES.get(part, ()):
        radius = float(of_sex(radii, sex))
        capsules.append(_capsule(start, end, radius, height, thickness))
    return capsules


def _trunk(part: str, height: float, thickness: float, sex: Sex | None) -> list[Capsule]:
    capsules = []
    if part == "Pelvis":
        for (z, x), breadths in _RINGS:
            half_breadth, radius = of_sex(breadths, sex)
            y = (half_breadth - radius) * thickness
            capsules.append(_capsule((x, -y, z), (x, y, z), radius, height, thickness))
    if part in _COLUMNS:
        (bottom, top, x), size = _COLUMNS[part]
        below, above, radius = of_sex(size, sex)
        for side in (0, 1, -1):
            low, high = (side * (b - radius) * thickness for b in (below, above))
            capsules.append(_capsule((x, low, bottom), (x, high, top), radius, height, thickness))
    if part == "T8" and sex == "female":
        (x, y, z), radius = _BUST
        for at in ((x, y, z), (x, -y, z)):  # spheres
            capsules.append(_capsule(at, at, radius, height, thickness))
    return capsules


def _capsule(start: Triple, end: Triple, radius: float, height: float, thickness: float) -> Capsule:
    return Capsule(np.array(start) * height, np.array(end) * height, radius * height * thickness)
