"""What a vehicle measures: how far it goes, how much it turns, and ranges to anchors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mocap_jax.errors import InputError


@dataclass(frozen=True)
class Odometry:
    """Steps from each of n + 1 times to the next."""

    time: Float[np.ndarray, "n+1"]
    """Rising [s]."""
    distance: Float[np.ndarray, "n"]
    """Travelled in a step [m]."""
    turn: Float[np.ndarray, "n"]
    """Change of heading in a step, anticlockwise [rad]."""

    def __post_init__(self) -> None:
        if not len(self.time) == len(self.distance) + 1 == len(self.turn) + 1 > 1:
            raise InputError(
                f"odometry: {len(self.time)} times, {len(self.distance)} distances, "
                f"{len(self.turn)} turns; there must be one time more than steps"
            )
        for name in ("time", "distance", "turn"):
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f"odometry: {name}: there are values that are not finite")
        if not (np.diff(self.time) > 0).all():
            raise InputError("odometry: times must rise")


@dataclass(frozen=True)
class AnchorRanges:
    """Ranges to anchors, at times of their own."""

    time: Float[np.ndarray, "r"]
    """[s]"""
    anchor: Int[np.ndarray, "r"]
    """Index into the anchors."""
    range: Float[np.ndarray, "r"]
    """[m]"""

    def __post_init__(self) -> None:
        if not len(self.time) == len(self.anchor) == len(self.range):
            raise InputError("ranges: times, anchors and ranges must be equally many")
        if not (np.isfinite(self.range) & np.isfinite(self.time)).all():
            raise InputError("ranges: there are values that are not finite; leave them out")
