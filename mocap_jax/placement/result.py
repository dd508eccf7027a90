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
    expected_deg: dict[str, float]
    """The same of each segment's orientation relative to the root segment."""

    @property
    def mean_cm(self) -> float:
        """Mean of the joints' expected errors [cm]."""
        return float(np.mean(list(self.expected_cm.values())))

    @property
    def mean_deg(self) -> float:
        """Mean of the segments' expected errors [deg]."""
        return float(np.mean(list(self.expected_deg.values())))

    def expected(self, quantity: str) -> dict[str, float]:
        """Expected errors of a quantity [cm] or [deg]."""
        return self.expected_cm if quantity == "position" else self.expected_deg


@dataclass(frozen=True)
class CurvePoint:
    """The best placement found with a number of sensors."""

    sensors: int
    segments: tuple[str, ...]
    mean_cm: float
    mean_deg: float
    exhaustive: bool

    def mean(self, quantity: str) -> float:
        """Mean expected error of a quantity [cm] or [deg]."""
        return self.mean_cm if quantity == "position" else self.mean_deg


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
    def unit(self) -> str:
        """Of what the study asks for."""
        return "cm" if self.options.quantity == "position" else "deg"

    @property
    def best(self) -> Placement:
        """The first of the ranking."""
        return self.placements[0]
