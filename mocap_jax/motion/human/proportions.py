"""Where the joints of the human body are, as fractions of stature, by sex.

Joint centres of the legs, elbow, wrist and fingertip are at the heights of Drillis and Contini
1966 (fractions of stature in Winter 2009, figure 4.1). The shoulder's centre lies above the elbow
by the length of the upper arm between joint centres in de Leva 1996, table 4 (figure 4.1 measures
to the acromion). Division of the trunk at L5/S1, L4/L3, T12/L1, T9/T8, C7/T1 and the occiput by
mean vertebral heights, breadths of shoulders and hips by sex: our choice. De Leva's own leg lengths
are not used: his female thigh is three hundredths of stature shorter than the male one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

Sex = Literal["female", "male"]
SEXES: tuple[Sex, ...] = ("female", "male")
SIDES = ("Right", "Left")

# Offset of each joint from its parent's; Y is for the left side. Pairs are (female, male).
_MIDDLE = {
    "L5": ("Pelvis", (-0.010, 0.0, 0.055)),
    "L3": ("L5", (0.0, 0.0, 0.042)),
    "T12": ("L3", (0.0, 0.0, 0.058)),
    "T8": ("T12", (0.0, 0.0, 0.063)),
    "Neck": ("T8", (0.0, 0.0, 0.107)),
    "Head": ("Neck", (0.005, 0.0, 0.058)),
}
_SIDED = {
    "Shoulder": ("T8", (0.012, 0.012, 0.068)),
    "UpperArm": ("Shoulder", ((-0.010, 0.094, -0.0274), (-0.010, 0.100, -0.0242))),
    "ForeArm": ("UpperArm", ((0.0, 0.0, -0.1586), (0.0, 0.0, -0.1618))),
    "Hand": ("ForeArm", (0.0, 0.0, -0.146)),
    "UpperLeg": ("Pelvis", ((0.0, 0.051, 0.0), (0.0, 0.048, 0.0))),
    "LowerLeg": ("UpperLeg", (0.0, 0.0, -0.245)),
    "Foot": ("LowerLeg", (0.0, 0.0, -0.246)),
    "Toe": ("Foot", (0.075, 0.0, -0.028)),
}
PARENT = {part: parent for part, (parent, _) in (_MIDDLE | _SIDED).items()}
"""Parent of each segment, without side; the pelvis has none."""
SIDED = tuple(_SIDED)
"""Segments that come in pairs."""

_TIPS = {"Head": (0.0, 0.0, 0.087), "Hand": (0.0, 0.0, -0.108), "Toe": (0.040, 0.0, 0.0)}
"""Vertex, tip of the middle finger and of the toes, from the segment's own joint."""
NEXT = {
    "Pelvis": "L5", "L5": "L3", "L3": "T12", "T12": "T8", "T8": "Neck", "Neck": "Head",
    "Shoulder": "UpperArm", "UpperArm": "ForeArm", "ForeArm": "Hand", "UpperLeg": "LowerLeg",
    "LowerLeg": "Foot", "Foot": "Toe",
}  # fmt: skip
"""Segment whose joint ends a segment; Head, Hand and Toe end in a tip."""
LONG_AXIS = {part: 2 for part in ("Pelvis", *_MIDDLE)} | {
    "Shoulder": 1, "UpperArm": 2, "ForeArm": 2, "Hand": 2, "UpperLeg": 2, "LowerLeg": 2,
    "Foot": 0, "Toe": 0,
}  # fmt: skip
"""Axis of the segment's frame along which a longer segment is stretched."""


@dataclass(frozen=True)
class Proportions:
    """Joints and tips, left side, as fractions of stature."""

    offset: dict[str, Float[np.ndarray, "3"]]
    """Of each joint from its parent's."""
    end: dict[str, Float[np.ndarray, "3"]]
    """Of the next joint, or the tip, from the segment's own joint."""

    def place(self, part: str) -> Float[np.ndarray, "3"]:
        """Joint from the middle of the hips, in the zero pose."""
        if part == "Pelvis":
            return np.zeros(3)
        return self.offset[part] + self.place(PARENT[part])


def proportions(sex: Sex | None) -> Proportions:
    """Proportions of a sex; those of None are the mean of both."""
    offset = {part: _offset(value, sex) for part, (_, value) in (_MIDDLE | _SIDED).items()}
    end = {part: offset[following] for part, following in NEXT.items()}
    return Proportions(offset, end | {part: np.array(tip) for part, tip in _TIPS.items()})


def _offset(value: object, sex: Sex | None) -> np.ndarray:
    array = np.asarray(value, float)
    return of_sex(array, sex) if array.shape == (2, 3) else array


def of_sex(pair: ArrayLike, sex: Sex | None) -> np.ndarray:
    """Of a pair (female, male) the one of a sex; for None their mean."""
    array = np.asarray(pair, float)
    return array.mean(axis=0) if sex is None else array[SEXES.index(sex)]


def side_of(segment: str) -> tuple[str, str]:
    """Side ("Right", "Left" or "") and part of a segment's name."""
    side = next((s for s in SIDES if segment.startswith(s)), "")
    return side, segment.removeprefix(side)


def mirrored(vector: np.ndarray, side: str) -> np.ndarray:
    """A left side's vector on the given side."""
    return vector * ([1.0, -1.0, 1.0] if side == "Right" else [1.0, 1.0, 1.0])
