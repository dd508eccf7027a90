"""`Keeper`: the best choices of segments whose sensors keep their least distance, and where."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError
from mocap_jax.placement.options import SearchOptions
from mocap_jax.placement.search import starts
from mocap_jax.placement.selection import Subset
from mocap_jax.placement.spacing import Resting, closest, kept_apart
from mocap_jax.placement.surface import Patch, Surfaces


class DistanceError(InputError):
    """No choice of segments was found whose sensors keep the least distance."""


@dataclass
class Keeper:
    """Finds places that keep a distance; remembers what it found, and pairs without any."""

    patches: tuple[Patch, ...]
    resting: Resting
    distance: float
    """[m]."""
    search: SearchOptions
    found: dict[Subset, Float[np.ndarray, "n 2"] | None] = field(default_factory=dict)

    def kept(self, subsets: Iterable[Subset]) -> Iterator[tuple[int, Subset]]:
        """Ranked subsets that have places far enough apart, and how many before them have not."""
        dropped = 0
        for subset in subsets:
            if self.places(subset) is None:
                dropped += 1
            else:
                yield dropped, subset

    def places(self, subset: Subset) -> Float[np.ndarray, "n 2"] | None:
        """Places near the patches' middles that keep the distance; None where none are found."""
        if subset not in self.found:
            # Pairs first: they are few, and one that is too near rules many choices out.
            near = len(subset) > 2 and any(
                self.places(pair) is None for pair in combinations(subset, 2)
            )
            self.found[subset] = None if near else self._apart(subset)
        return self.found[subset]

    def _apart(self, subset: Subset) -> Float[np.ndarray, "n 2"] | None:
        surfaces = Surfaces(tuple(self.patches[i] for i in subset))
        bodies = np.array([p.body for p in surfaces.patches])
        for free in starts(len(subset), self.search):
            places = surfaces.places(kept_apart(surfaces, self.resting, free, self.distance))
            if closest(surfaces.points(jnp.asarray(places)), bodies, self.resting) >= self.distance:
                return np.asarray(places)
        return None
