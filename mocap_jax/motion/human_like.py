"""`human_like`: the built-in human with the size and segment lengths of another skeleton."""

from __future__ import annotations

import math

import numpy as np

from mocap_jax.body import Body
from mocap_jax.motion.human import Sex, human, segment_lengths
from mocap_jax.motion.segment_match import RestPose, rest_pose

_LEG = ("UpperLeg", "LowerLeg", "Foot")
_ARM = ("UpperArm", "ForeArm", "Hand")
_TRUNK = ("Pelvis", "L5", "L3", "T12", "T8", "Neck")
_LEG_SHARE = 0.245 + 0.246  # hip to ankle as a fraction of stature, as in `human`
_LONGEST, _SHORTEST = 2.4, 0.42  # `human` refuses more


def human_like(body: Body, mass: float | None = None, sex: Sex | str | None = None) -> Body:
    """A `human()` that can do what another body does without being scaled.

    Stature follows from the legs. Thigh, shank, upper arm and forearm get the other skeleton's
    lengths (mean of both sides), the clavicles its distance between the shoulders, trunk and neck
    together its height of the head's joint over the hips. Hands, feet and head keep stature's
    proportions.

    Args:
        body: with Xsens, CMU, BVH or dm_control segment names.
        mass: [kg]; by default that of a body mass index of 22.9 (70 kg at 1.75 m).
        sex: as for `human`.

    Raises:
        InputError: a body without pelvis, thighs or trunk, or of no human size.
    """
    rest = rest_pose(body, "the body to be like")
    thigh, shank = (_length(rest, *pair) for pair in zip(_LEG, _LEG[1:], strict=False))
    height = (thigh + shank) / _LEG_SHARE if thigh and shank else 1.75
    mass = 70.0 * (height / 1.75) ** 2 if mass is None else mass
    usual = human(height, mass, sex)
    lengths = {"UpperLeg": thigh, "LowerLeg": shank}
    for part, following in zip(_ARM, _ARM[1:], strict=False):
        lengths[part] = _length(rest, part, following)
    lengths |= _trunk_lengths(rest, usual) | _shoulder_length(rest, usual)
    own = segment_lengths(usual)
    known = {n: _bounded(length, own, n) for n, length in lengths.items() if length}
    return human(height, mass, sex, known)


def _bounded(length: float, own: dict[str, float], name: str) -> float:
    usual = own.get(name, own.get(f"Left{name}", 0.0))
    return min(max(length, _SHORTEST * usual), _LONGEST * usual)


def _length(rest: RestPose, part: str, following: str) -> float:
    """Mean length [m] of a segment on both sides; 0 where it has none."""
    ends = [
        rest.position[side + following] - rest.position[side + part]
        for side in ("Left", "Right")
        if {side + part, side + following} <= rest.position.keys()
    ]
    return float(np.linalg.norm(ends, axis=1).mean()) if ends else 0.0


def _trunk_lengths(rest: RestPose, usual: Body) -> dict[str, float]:
    """Lengths of trunk and neck, in the usual ratios, that put the head where it is over the hips.

    The joints between differ too much among skeletons (CMU's shoulders lie above its neck's base).
    """
    own, target = segment_lengths(usual), rest_pose(usual, "human()")
    top = next((name for name in ("Head", "Neck") if name in rest.position), None)
    if top is None:
        return {}
    there, here = (r.position[top][2] - _hip_height(r) for r in (rest, target))
    return {part: own[part] * there / here for part in _TRUNK} if there > 0 else {}


def _hip_height(rest: RestPose) -> float:
    return float(np.mean([rest.position[f"{s}UpperLeg"][2] for s in ("Left", "Right")]))


def _shoulder_length(rest: RestPose, usual: Body) -> dict[str, float]:
    """Length of the clavicles that gives the distance between the shoulders."""
    if "LeftUpperArm" not in rest.position or "RightUpperArm" not in rest.position:
        return {}
    half = float(np.linalg.norm(rest.position["LeftUpperArm"] - rest.position["RightUpperArm"])) / 2
    index, place = usual.topology.body_index, np.asarray(usual.body_pos)
    inner = float(place[index("LeftShoulder"), 1])
    x, _, z = place[index("LeftUpperArm")].tolist()
    return {"Shoulder": math.hypot(max(half - inner, 0.02), x, z)}
