"""What a placement study returns: ranked placements, error by number of sensors, what is proven."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.placement.certificate import Certificate
from mocap_jax.placement.options import PlacementOptions
from mocap_jax.simulation import Suit


@dataclass(frozen=True)
class Placement:
    """Sensors on a body and what they are expected to achieve."""

    segments: tuple[str, ...]
    places: Float[np.ndarray, "n 2"]
    """Share of each patch's axis and angle around it [rad]."""
    suit: Suit
    """Ready for `simulate`."""
    value: float
    """Of the criterion."""
    expected_cm: dict[str, float]
    """Root mean square error of each joint centre relative to the root, over all motions."""

    @property
    def mean_cm(self) -> float:
        """Mean of the joints' expected errors [cm]."""
        return float(np.mean(list(self.expected_cm.values())))

    @property
    def worst(self) -> str:
        """The joint of the largest expected error."""
        return max(self.expected_cm, key=self.expected_cm.__getitem__)


@dataclass(frozen=True)
class CurvePoint:
    """The best placement found with a number of sensors."""

    sensors: int
    segments: tuple[str, ...]
    mean_cm: float
    exhaustive: bool


@dataclass(frozen=True)
class PlacementStudy:
    """Result of `place`."""

    body: Body
    """As given, with shapes."""
    motions: tuple[str, ...]
    placements: tuple[Placement, ...]
    """The best first."""
    curve: tuple[CurvePoint, ...]
    """Expected error by number of sensors."""
    certificate: Certificate
    """Of the choice of segments, at the middles of their patches."""
    options: PlacementOptions
    seconds: float

    @property
    def best(self) -> Placement:
        """The first of the ranking."""
        return self.placements[0]
