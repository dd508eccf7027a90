"""Angles between rotations."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def rotation_angle(
    R_a: Float[np.ndarray, "*b 3 3"], R_b: Float[np.ndarray, "*b 3 3"]
) -> Float[np.ndarray, "*b"]:
    """Angle [rad], 0 to pi, between two rotations (from the chord, exact for small angles)."""
    chord = np.sqrt(((R_a - R_b) ** 2).sum(axis=(-1, -2)))
    return 2 * np.arcsin(np.minimum(chord / np.sqrt(8.0), 1.0))
