"""Flesh for bare skeletons: a capsule along each segment, so that bodies occlude and look human.

Radii are half the typical adult segment breadths (rounded from NASA-STD-3000 volume I, section 3,
50th percentile); trunk segments get a capsule from left to right, which gives their flat section.
"""

from __future__ import annotations

import numpy as np

from mocap_jax.motion.skeleton import Bone, Capsule, Skeleton

_RADIUS = {
    "Neck": 0.055, "Head": 0.09, "Shoulder": 0.04, "UpperArm": 0.045, "ForeArm": 0.035,
    "Hand": 0.03, "UpperLeg": 0.07, "LowerLeg": 0.05, "Foot": 0.035, "Toe": 0.02,
}  # fmt: skip
_RADIUS_BY_PART = {
    "neck": 0.055, "hipjoint": 0.08, "buttock": 0.08, "wrist": 0.03, "thumb": 0.01,
    "finger": 0.01, "index": 0.01, "mid": 0.01, "ring": 0.01, "pinky": 0.01, "eye": 0.012,
}  # fmt: skip
_TRUNK = {"Pelvis": (0.105, 0.065), "L5": (0.105, 0.05), "L3": (0.105, 0.055),
          "T12": (0.11, 0.06), "T8": (0.11, 0.065)}  # fmt: skip
"""Radius and half distance between the capsule's centres [m]."""
_OTHER_RADIUS = 0.02


def segment_shapes(skeleton: Skeleton) -> dict[str, list[Capsule]]:
    """One capsule for each bone, in the bone's frame."""
    zero = skeleton.zero_pose()
    return {
        bone.name: [_trunk(bone, zero[bone.name][0].inv().apply([0.0, 1.0, 0.0]))]
        if bone.name in _TRUNK
        else [_along(bone)]
        for bone in skeleton.bones
    }


def _trunk(bone: Bone, left: np.ndarray) -> Capsule:
    radius, half = _TRUNK[bone.name]
    middle = bone.end / 2
    return Capsule(middle - half * left, middle + half * left, radius)


def _along(bone: Bone) -> Capsule:
    radius = segment_radius(bone.name)
    length = float(np.linalg.norm(bone.end))
    # Round ends reach one radius beyond the end: draw the cap in so that a head or a toe tip
    # does not grow, but never turn the segment round.
    reach = max(length - radius, 0.5 * length) / length if length > 0 else 0.0
    tip = bone.end * (reach if bone.name == "Head" else 1.0)
    return Capsule(np.zeros(3), tip, radius)


def segment_radius(name: str) -> float:
    """Radius [m] of a segment by its Xsens or own name."""
    bare = name.removeprefix("Left").removeprefix("Right")
    if bare in _RADIUS:
        return _RADIUS[bare]
    lowered = name.lower()
    return next((r for part, r in _RADIUS_BY_PART.items() if part in lowered), _OTHER_RADIUS)
