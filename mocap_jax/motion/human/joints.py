"""The joints of the human body: names, axes and ranges of motion.

A limit is the larger of the normal range of the American Academy of Orthopaedic Surgeons (1965,
Joint motion: method of measuring and recording) and the mean of Boone and Azen 1979 (J Bone Joint
Surg 61-A:756-759, men of 20 to 54 years). Exceptions: dorsiflexion is that of a loaded ankle, the
elbow may overextend by 5 degrees, the clavicle's ranges are rounded from Kapandji's Physiology of
the Joints (our choice). Spine and neck share the Academy's ranges of the whole (80 degrees of
flexion of the trunk; 45 of the neck, with 60 of rotation).
"""

from __future__ import annotations

import math

from mocap_jax.motion.human.proportions import side_of
from mocap_jax.motion.skeleton import Joint

BALL_LIMIT = {"L5": 25, "L3": 25, "T12": 20, "T8": 20, "Neck": 40, "Head": 40, "UpperLeg": 125}
"""Largest excursion of a ball joint [deg]; the shoulder reaches half a turn, so it has none."""

HINGES = {
    "Shoulder": (("protraction", (0, 0, -1), (-25, 30)), ("elevation", (1, 0, 0), (-10, 40))),
    "ForeArm": (("flexion", (0, -1, 0), (-5, 150)), ("pronation", (0, 0, -1), (-82, 80))),
    "Hand": (("flexion", (-1, 0, 0), (-75, 80)), ("radial_deviation", (0, -1, 0), (-36, 22))),
    "LowerLeg": (("flexion", (0, 1, 0), (-10, 143)),),
    "Foot": (("dorsiflexion", (0, -1, 0), (-56, 30)), ("inversion", (-1, 0, 0), (-21, 37))),
    "Toe": (("extension", (0, -1, 0), (-45, 70)),),
}
"""Hinges, outer first: motion, axis of positive turns on the left side, range [deg]."""


def segment_joints(segment: str) -> tuple[Joint, ...]:
    """Joints between a segment and its parent, outer first."""
    side, part = side_of(segment)
    if part not in HINGES:
        limit = BALL_LIMIT.get(part)
        return (Joint(segment, None, (0.0, math.radians(limit)) if limit else None),)
    # An axis is a pseudovector: reflection in the mid-plane keeps Y and reverses X and Z.
    flip = -1.0 if side == "Right" else 1.0
    return tuple(
        Joint(
            f"{segment}_{motion}",
            (flip * x, 1.0 * y, flip * z),
            (math.radians(low), math.radians(high)),
        )
        for motion, (x, y, z), (low, high) in HINGES[part]
    )
