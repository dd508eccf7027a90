"""How far sensors are from each other, in the reference pose, and places that keep them apart."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import Array
from jaxtyping import Float

from mocap_jax.placement.surface import Patch, Surfaces

# What sensors are moved apart by beyond the least distance, so that rounding does not undo it.
_MARGIN = 1.01
_STEPS, _RATE = 300, 0.1
# Places of a patch that are tried for its greatest distance from others, each way.
_GRID = 6


@dataclass(frozen=True)
class Resting:
    """Frames of segments in the reference pose, where distances are checked."""

    rotation: Float[np.ndarray, "b 3 3"]
    position: Float[np.ndarray, "b 3"]

    def world(self, bodies: np.ndarray, points: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
        """Points of segments [m] in the world."""
        turned = jnp.einsum("nij,nj->ni", self.rotation[bodies], points)
        return self.position[bodies] + turned


def crowding(
    points: Float[Array, "n 3"], bodies: np.ndarray, resting: Resting, distance: float
) -> Float[Array, ""]:
    """Sum of squared shares by which sensors are closer than allowed; 0 where none is."""
    apart = _distances(points, bodies, resting)
    return (jnp.maximum(1 - apart / distance, 0.0) ** 2).sum() if distance > 0 else jnp.zeros(())


def closest(points: Float[Array, "n 3"], bodies: np.ndarray, resting: Resting) -> float:
    """Least distance between two sensors [m]; infinite for a single one."""
    return float(jnp.min(_distances(points, bodies, resting), initial=jnp.inf))


def _distances(
    points: Float[Array, "n 3"], bodies: np.ndarray, resting: Resting
) -> Float[Array, "p"]:
    world = resting.world(bodies, points)
    first, second = np.triu_indices(len(bodies), 1)
    return jnp.sqrt(((world[first] - world[second]) ** 2).sum(-1) + 1e-12)


def kept_apart(
    surfaces: Surfaces, resting: Resting, free: Float[np.ndarray, "n 2"], distance: float
) -> Float[np.ndarray, "n 2"]:
    """Unbounded coordinates near given ones, with sensors apart where their patches allow it.

    Args:
        surfaces: patches of the sensors.
        resting: reference pose.
        free: where to start; returned as they are where sensors are apart.
        distance: least distance [m].
    """
    bodies = np.array([p.body for p in surfaces.patches])
    points = lambda x: surfaces.points(surfaces.places(x))  # noqa: E731
    slope = jax.jit(jax.grad(lambda x: crowding(points(x), bodies, resting, _MARGIN * distance)))
    # Two patches whose middles lie above each other part by a first push.
    current = jnp.asarray(free, float)
    optimiser = optax.adam(_RATE)
    state = optimiser.init(current)
    for _ in range(_STEPS):
        if closest(points(current), bodies, resting) >= distance:
            break
        change, state = optimiser.update(slope(current), state)
        current = jnp.clip(current + change, -4.0, 4.0)
    return np.asarray(current)


def farthest(patches: tuple[Patch, ...], resting: Resting) -> Float[np.ndarray, "n n"]:
    """How far a sensor on one patch can be from one on another, at most [m]."""
    share = np.linspace(-4.0, 4.0, _GRID)
    grid = np.stack(np.meshgrid(share, share), -1).reshape(-1, 2)
    world = []
    for patch in patches:
        surfaces = Surfaces((patch,) * len(grid))
        points = surfaces.points(surfaces.places(jnp.asarray(grid)))
        world.append(np.asarray(resting.world(np.full(len(grid), patch.body), points)))
    every = np.stack(world)
    apart = np.linalg.norm(every[:, None, :, None] - every[None, :, None, :], axis=-1)
    return apart.max((2, 3))
