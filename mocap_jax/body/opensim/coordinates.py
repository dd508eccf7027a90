"""Coordinates of a whole model: which are fixed, which are free and which follow others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_jax.body.opensim.model import Coordinate, OsimModel
from mocap_jax.body.piecewise import Piecewise
from mocap_jax.errors import InputError


@dataclass(frozen=True)
class Known:
    """A coordinate with its value in the model's default pose."""

    coordinate: Coordinate
    default: float
    follows: tuple[str, Piecewise] | None = None
    """The coordinate it follows by a coupler, and how."""

    @property
    def fixed(self) -> bool:
        return self.coordinate.locked

    @property
    def limits(self) -> tuple[float, float] | None:
        """Range, where it is enforced."""
        return self.coordinate.range if self.coordinate.clamped else None


def known_coordinates(model: OsimModel, name: str) -> dict[str, Known]:
    """Coordinates by name; one that follows a locked one is locked as well.

    Raises:
        InputError: a coupler names no coordinate, or couplers follow each other in a circle.
    """
    plain = {c.name: c for joint in model.joints for c in joint.coordinates}
    couplers = {c.dependent: c for c in model.couplers}
    for coupler in model.couplers:
        for used in (coupler.dependent, coupler.independent):
            if used not in plain:
                raise InputError(f"{name}: a coordinate coupler names no coordinate: '{used}'")
    known = {n: Known(c, c.default) for n, c in plain.items() if n not in couplers or c.locked}
    left = [n for n in couplers if n not in known]
    while left:
        ready = [n for n in left if couplers[n].independent in known]
        if not ready:
            raise InputError(f"{name}: coordinate couplers follow each other: {', '.join(left)}")
        for n in ready:
            source, function = known[couplers[n].independent], couplers[n].function
            value = float(function(np.asarray(source.default)))
            c = plain[n]
            locked = Coordinate(n, value, c.range, c.clamped, source.fixed)
            follows = None if source.fixed else (source.coordinate.name, function)
            known[n] = Known(locked, value, follows)
        left = [n for n in left if n not in known]
    return known
