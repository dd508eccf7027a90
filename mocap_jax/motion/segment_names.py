"""Segment names: what other systems call the segments that Xsens' 23-segment naming covers."""

from __future__ import annotations

_MIDDLE = {
    "Pelvis": ("pelvis", "hips", "hip", "root"),
    "L5": ("l5", "lowerback", "abdomen"),
    "L3": ("l3", "upperback", "spine"),
    "T12": ("t12",),
    "T8": ("t8", "thorax", "spine1", "chest", "torso"),
    "Neck": ("neck", "lowerneck"),
    "Head": ("head",),
}
_SIDED = {
    "Shoulder": ("clavicle", "collar", "shoulder"),
    "UpperArm": ("humerus", "shldr", "arm", "upperarm"),
    "ForeArm": ("radius", "ulna", "forearm", "lowerarm"),
    "Hand": ("hand",),
    "UpperLeg": ("femur", "thigh", "upleg", "upperleg"),
    "LowerLeg": ("tibia", "shin", "leg", "lowerleg"),
    "Foot": ("foot", "talus"),
    "Toe": ("toes", "toebase", "toe"),
}
XSENS_SEGMENTS: tuple[str, ...] = (
    *_MIDDLE,
    *(side + name for side in ("Right", "Left") for name in _SIDED),
)
"""The 23 segments, in the order pelvis to head, right arm and leg, left arm and leg."""

_TABLE = {other: name for name, others in _MIDDLE.items() for other in others} | {
    word: side + name
    for side, prefixes in (("Left", ("left", "l")), ("Right", ("right", "r")))
    for prefix in prefixes
    for name, others in _SIDED.items()
    for other in others
    # OpenSim has the side last: `femur_r`.
    for word in (prefix + other, *([other + prefix] if len(prefix) == 1 else []))
}


def xsens_name(name: str) -> str:
    """Xsens name of a segment known by a CMU ASF, BVH (Hahne, DAZ), dm_control or OpenSim name.

    Names that correspond to none of the 23 segments are returned unchanged, so the function is
    idempotent. A namespace such as `mixamorig:` is ignored.
    """
    key = name.rsplit(":", 1)[-1].replace("_", "").lower()
    return _TABLE.get(key, name)


def unique_xsens_names(names: list[str]) -> list[str]:
    """Xsens names of a whole skeleton; of two segments with the same one, the first gets it."""
    taken: set[str] = set()
    result = []
    for name in names:
        candidate = xsens_name(name)
        if candidate in taken:
            candidate = name
        taken.add(candidate)
        result.append(candidate)
    return result
