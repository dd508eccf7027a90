"""Inertial parameters of body segments by sex: de Leva 1996, table 4.

P. de Leva, Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters, J Biomech
29(9):1223-1230. Upper trunk, head, hand and shank are in the table's second part, which refers them
to joints. Each row: mass [% of body mass], length [mm], centre of mass [% of length from the upper
end], radii of gyration about the centre [% of length] for the fore-aft, the left-right and the long
axis (of the foot, whose long axis points forward: vertical, left-right, long).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.motion.human.proportions import SEXES, Sex

_STATURE = {"female": 1735.0, "male": 1741.0}  # [mm]
_ROWS = {
    "female": {
        "head": (6.68, 243.7, 48.41, 27.1, 29.5, 26.1),  # vertex to C7
        "upper_trunk": (15.45, 228.0, 50.50, 46.6, 31.4, 44.9),  # C7 to xiphoid
        "middle_trunk": (14.65, 205.3, 45.12, 43.3, 35.4, 41.5),  # xiphoid to navel
        "lower_trunk": (12.47, 181.5, 49.20, 43.3, 40.2, 44.4),  # navel to middle of the hips
        "upper_arm": (2.55, 275.1, 57.54, 27.8, 26.0, 14.8),
        "forearm": (1.38, 264.3, 45.59, 26.1, 25.7, 9.4),
        "hand": (0.56, 170.1, 34.27, 24.4, 20.8, 15.4),  # wrist to tip of the middle finger
        "thigh": (14.78, 368.5, 36.12, 36.9, 36.4, 16.2),
        "shank": (4.81, 438.6, 43.52, 26.7, 26.3, 9.2),  # knee to ankle
        "foot": (1.29, 228.3, 40.14, 27.9, 29.9, 13.9),  # heel to tip of the longest toe
    },
    "male": {
        "head": (6.94, 242.9, 50.02, 30.3, 31.5, 26.1),
        "upper_trunk": (15.96, 242.1, 50.66, 50.5, 32.0, 46.5),
        "middle_trunk": (16.33, 215.5, 45.02, 48.2, 38.3, 46.8),
        "lower_trunk": (11.17, 145.7, 61.15, 61.5, 55.1, 58.7),
        "upper_arm": (2.71, 281.7, 57.72, 28.5, 26.9, 15.8),
        "forearm": (1.62, 268.9, 45.74, 27.6, 26.5, 12.1),
        "hand": (0.61, 187.9, 36.24, 28.8, 23.5, 18.4),
        "thigh": (14.16, 422.2, 40.95, 32.9, 32.9, 14.9),
        "shank": (4.33, 440.3, 43.95, 25.1, 24.6, 10.2),
        "foot": (1.37, 258.1, 44.15, 24.5, 25.7, 12.4),
    },
}
TRUNK = ("lower_trunk", "middle_trunk", "upper_trunk")
"""Parts of the trunk, from below."""
PAIRED = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
"""Parts that the body has twice."""


@dataclass(frozen=True)
class Row:
    """One part of the body."""

    mass: float
    """Share of body mass; all parts of the body sum to one."""
    length: float
    """Fraction of stature."""
    centre: float
    """Centre of mass, fraction of length from the upper end (the foot: from the heel)."""
    radii: Float[np.ndarray, "3"]
    """Of gyration about the centre, fractions of length, as in the table."""

    @property
    def spread(self) -> Float[np.ndarray, "3"]:
        """Mean squared distance from the centre along each of the three axes [length squared]."""
        squares = self.radii**2
        return squares.sum() / 2 - squares


def table(sex: Sex | None) -> dict[str, Row]:
    """Table of a sex; that of None is the mean of both."""
    rows = np.mean([_numbers(s) for s in (SEXES if sex is None else (sex,))], axis=0)
    named = dict(zip(_ROWS["male"], rows, strict=True))
    # The printed female masses sum to 99.99 %.
    total = sum(row[0] * (2 if part in PAIRED else 1) for part, row in named.items())
    return {
        part: Row(float(row[0] / total), float(row[1]), float(row[2]), row[3:])
        for part, row in named.items()
    }


def _numbers(sex: Sex) -> Float[np.ndarray, "n 6"]:
    """Rows of one sex as fractions."""
    rows = np.array(list(_ROWS[sex].values()))
    return rows / [100.0, _STATURE[sex], 100.0, 100.0, 100.0, 100.0]
