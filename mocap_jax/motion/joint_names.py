"""Names of joints in files of joint positions, as segments: a joint starts the segment after it."""

from __future__ import annotations

from mocap_jax.motion.segment_names import unique_xsens_names

SMPL_JOINTS = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar",
    "head", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist",
    "right_wrist", "left_hand", "right_hand",
)  # fmt: skip
"""The 24 joints of SMPL's kinematic tree, in its order."""
SMPL_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)
"""Their parents in that order."""
_MIDDLE = {
    "pelvis": "Pelvis", "spine1": "L5", "spine2": "T12", "spine3": "T8", "neck": "Neck",
    "head": "Head",
}  # fmt: skip
_SIDED = {
    "hip": "UpperLeg", "knee": "LowerLeg", "ankle": "Foot", "foot": "Toe", "collar": "Shoulder",
    "shoulder": "UpperArm", "elbow": "ForeArm", "wrist": "Hand", "hand": "Fingers",
}  # fmt: skip
_SEGMENT_OF = _MIDDLE | {
    f"{prefix}{joint}": side + segment
    for side in ("Left", "Right")
    for prefix in (side.lower(), side[0].lower())
    for joint, segment in _SIDED.items()
}
# What tells names of joints from names of segments, which share `foot`, `hand` and `shoulder`.
_TELLING = {f"{p}{joint}" for p in ("left", "right", "l", "r") for joint in ("hip", "knee")}


def segment_names(joints: tuple[str, ...]) -> list[str]:
    """Xsens names of the segments that joints start; names that are none stay as they are.

    Joints by SMPL's names (`left_hip`, `L_Hip`, ...), or by the names of segments (Xsens', CMU's or
    a BVH's). SMPL's `left_hand`, the knuckles, becomes `LeftFingers`.
    """
    keys = [_bare(name) for name in joints]
    if not _TELLING & set(keys):
        return unique_xsens_names(list(joints))
    return [_SEGMENT_OF.get(key, name) for key, name in zip(keys, joints, strict=True)]


def _bare(name: str) -> str:
    return name.replace("_", "").replace("-", "").replace(" ", "").lower()
