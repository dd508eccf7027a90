"""Mass, centre of mass and moments of inertia of the 23 segments, from de Leva's 16 parts.

Limbs take theirs as they are, scaled by the segment's own length. The other parts are divided:

- Trunk: lower, middle and upper part (hips to navel to xiphoid to C7, levels in the table's ratios)
  have a density that changes linearly with height, such that mass and centre of mass are
  the table's; cutting them at L5/S1, L4/L3, T12/L1 and T9/T8 gives Pelvis, L5, L3, T12 and T8.
  Spread across is the part's own.
- Each shoulder girdle takes a tenth of the upper trunk (our choice), about the clavicle's middle.
- Neck: 18 % of the table's head (which reaches to C7), a cylinder, after the volumes' ratio (our
  choice); the head is the rest.
- Foot: the same linear density, cut at the base of the toes.

Segments that together make a part have its mass and centre of mass exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.motion.human.de_leva import TRUNK, Row, table
from mocap_jax.motion.human.proportions import Proportions, Sex, proportions

_GIRDLE_SHARE = 0.10
_NECK_SHARE = 0.18
_NECK_RADIUS = 0.033
_HEAD_FORWARD = 0.012  # of the head's centre before its joint
_HEEL = -0.037  # from the ankle, forward
_FOOT_CENTRE_HEIGHT = -0.022  # from the ankle
_LIMBS = {"UpperArm": "upper_arm", "ForeArm": "forearm", "Hand": "hand", "UpperLeg": "thigh",
          "LowerLeg": "shank"}  # fmt: skip
_TRUNK_SEGMENTS = ("Pelvis", "L5", "L3", "T12", "T8")


@dataclass(frozen=True)
class Lump:
    """A mass: share of the body's, centre and mean squared spread along X, Y and Z about it."""

    mass: float
    centre: Float[np.ndarray, "3"]
    """[stature]"""
    spread: Float[np.ndarray, "3"]
    """[stature squared]"""

    def moved(self, shift: Float[np.ndarray, "3"]) -> Lump:
        """The same lump with its centre shifted."""
        return Lump(self.mass, self.centre + shift, self.spread)

    @property
    def second(self) -> Float[np.ndarray, "3"]:
        """Mass times mean squared distance from the origin, along each axis."""
        return self.mass * (self.spread + self.centre**2)


def combined(lumps: list[Lump]) -> Lump:
    """Several lumps as one; a lump of negative mass is taken away."""
    mass = sum(lump.mass for lump in lumps)
    centre = np.sum([lump.mass * lump.centre for lump in lumps], axis=0) / mass
    return Lump(mass, centre, np.sum([lump.second for lump in lumps], axis=0) / mass - centre**2)


def segment_lumps(sex: Sex | None) -> dict[str, Lump]:
    """Mass distribution of every segment of the left side, in its own frame, by name without side.

    Shares of body mass and fractions of stature; those of the middle and twice the rest sum to one.
    """
    rows, body = table(sex), proportions(sex)
    lumps = {part: _limb(rows[name], body.end[part]) for part, name in _LIMBS.items()}
    hand = lumps[
        "Hand"
    ]  # with the palm to the thigh, what the table calls fore-aft points sideways
    lumps["Hand"] = Lump(hand.mass, hand.centre, hand.spread[[1, 0, 2]])
    lumps |= _trunk(rows, body) | _head_and_neck(rows["head"], body)
    return lumps | _foot_and_toe(rows["foot"], body)


def _limb(row: Row, end: Float[np.ndarray, "3"]) -> Lump:
    return Lump(row.mass, row.centre * end, row.spread * (end @ end))


def _slab(centre: float, start: float, end: float) -> tuple[float, float, float]:
    """Share of mass, its mean place and variance between two places of a part of length one.

    The density 1 + 12 (c - 1/2) (x - 1/2) has the integral 1 and the mean c.
    """
    slope = 12 * (centre - 0.5)
    moments = [
        (1 - slope / 2) * (end**n - start**n) / n
        + slope * (end ** (n + 1) - start ** (n + 1)) / (n + 1)
        for n in (1, 2, 3)
    ]
    mean = moments[1] / moments[0]
    return moments[0], mean, moments[2] / moments[0] - mean**2


def _trunk(rows: dict[str, Row], body: Proportions) -> dict[str, Lump]:
    top = body.place("Neck")[2]
    scale = top / sum(rows[name].length for name in TRUNK)
    cuts = [*(max(body.place(part)[2], 0.0) for part in _TRUNK_SEGMENTS), top]
    pieces: dict[str, list[Lump]] = {part: [] for part in _TRUNK_SEGMENTS}
    bottom = 0.0
    for name in TRUNK:
        row = rows[name]
        height = row.length * scale
        for part, low, high in zip(_TRUNK_SEGMENTS, cuts, cuts[1:], strict=False):
            start, end = np.clip((np.array([low, high]) - bottom) / height, 0.0, 1.0)
            if end > start:
                share, mean, variance = _slab(1 - row.centre, start, end)
                spread = np.append(row.spread[:2] * row.length**2, variance * height**2)
                place = np.array([0.0, 0.0, bottom + mean * height])
                pieces[part].append(Lump(row.mass * share, place, spread))
        bottom += height
    whole = {part: combined(lumps) for part, lumps in pieces.items()}
    girdle = _girdle(rows["upper_trunk"], body)
    there = girdle.moved(body.place("Shoulder"))
    taken = [Lump(-there.mass, there.centre * [1, y, 1], there.spread) for y in (1, -1)]
    whole["T8"] = combined([whole["T8"], *taken])
    return {p: lump.moved(-body.place(p)) for p, lump in whole.items()} | {"Shoulder": girdle}


def _girdle(row: Row, body: Proportions) -> Lump:
    """A shoulder girdle: shoulder blade, clavicle and their muscles."""
    end = body.end["Shoulder"]
    spread = np.array([0.020, abs(end[1]) / np.sqrt(12), 0.025]) ** 2
    return Lump(_GIRDLE_SHARE * row.mass, end / 2, spread)


def _head_and_neck(row: Row, body: Proportions) -> dict[str, Lump]:
    neck, head = body.end["Neck"], body.end["Head"]
    length = neck[2] + head[2]
    across = _NECK_RADIUS**2 / 4
    lower = Lump(_NECK_SHARE * row.mass, neck / 2, np.array([across, across, neck[2] ** 2 / 12]))
    x = neck[0] + _HEAD_FORWARD
    centre_x = _NECK_SHARE * neck[0] / 2 + (1 - _NECK_SHARE) * x
    # Forward of its joint, the head adds nothing to the table's spread: that is about its centre.
    apart = _NECK_SHARE * (1 - _NECK_SHARE) * (x - neck[0] / 2) ** 2
    whole = Lump(
        row.mass,
        np.array([centre_x, 0.0, (1 - row.centre) * length]),
        row.spread * row.length**2 + [apart, 0.0, 0.0],
    )
    rest = combined([whole, Lump(-lower.mass, lower.centre, lower.spread)])
    return {"Neck": lower, "Head": rest.moved(-neck)}


def _foot_and_toe(row: Row, body: Proportions) -> dict[str, Lump]:
    toe, tip = body.end["Foot"], body.end["Toe"]
    length = toe[0] + tip[0] - _HEEL
    cut = (toe[0] - _HEEL) / length
    lumps = {}
    # The table's axes are vertical, left-right and long.
    z_spread, y_spread, _ = row.spread * row.length**2
    for part, (start, end) in {"Foot": (0.0, cut), "Toe": (cut, 1.0)}.items():
        share, mean, variance = _slab(row.centre, start, end)
        height = _FOOT_CENTRE_HEIGHT if part == "Foot" else toe[2]
        lumps[part] = Lump(
            row.mass * share,
            np.array([_HEEL + mean * length, 0.0, height]),
            np.array([variance * length**2, y_spread, z_spread]),
        )
    return lumps | {"Toe": lumps["Toe"].moved(-toe)}
