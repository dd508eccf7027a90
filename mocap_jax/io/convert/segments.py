"""Segments by the names that sensor systems and data sets give them."""

from __future__ import annotations

from mocap_jax.motion import XSENS_SEGMENTS, xsens_name

_MIDDLE = {
    "torso": "T8", "sternum": "T8", "trunk": "T8", "upper_back": "T8", "chest": "T8",
    "thorax": "T8", "spine2": "T8", "lumbar": "Pelvis", "lower_back": "L5", "sacrum": "Pelvis",
    "belly": "Pelvis", "hip": "Pelvis", "pelvis": "Pelvis", "head": "Head", "forehead": "Head",
}  # fmt: skip
_SIDED = {
    "calcn": "Foot", "foot": "Foot", "toes": "Toe", "tibia": "LowerLeg", "shank": "LowerLeg",
    "lower_leg": "LowerLeg", "lowleg": "LowerLeg", "knee": "LowerLeg", "femur": "UpperLeg",
    "thigh": "UpperLeg", "upper_leg": "UpperLeg", "upleg": "UpperLeg", "upper_arm": "UpperArm",
    "humerus": "UpperArm", "uparm": "UpperArm", "radius": "ForeArm", "ulna": "ForeArm",
    "forearm": "ForeArm", "lower_arm": "ForeArm", "lowarm": "ForeArm", "wrist": "ForeArm",
    "hand": "Hand", "shoulder": "Shoulder", "scapula": "Shoulder", "clavicle": "Shoulder",
}  # fmt: skip
_SIDES = {"l": "Left", "left": "Left", "r": "Right", "right": "Right"}


def segment_of(label: str) -> str:
    """Xsens name of the segment that a label means; the label itself where none is known.

    Understands OpenSim's (`calcn_r_imu`), qmt's (`upper_arm_left`), TotalCapture's (`L_LowArm`),
    APDM's (`Right Foot`) and the names that `xsens_name` knows.
    """
    if label in XSENS_SEGMENTS:
        return label
    words = label.lower().replace(" ", "_").replace("-", "_").split("_")
    words = [w for w in words if w not in ("imu", "sensor", "")]
    sides = [_SIDES[w] for w in words if w in _SIDES]
    rest = [w for w in words if w not in _SIDES]
    for key in ("_".join(rest), "".join(rest)):
        if len(sides) == 1 and key in _SIDED:
            return sides[0] + _SIDED[key]
        if not sides and key in _MIDDLE:
            return _MIDDLE[key]
    return xsens_name(label)
