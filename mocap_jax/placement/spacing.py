"""How far sensors are from each other, in the reference pose, and places that keep them apart."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import Array
from jaxtyping import Float
from scipy.spatial.distance import cdist

from mocap_jax.placement.surface import Patch, Surfaces, board_point

# What sensors are moved apart by beyond the least distance, so that rounding does not undo it.
_MARGIN = 1.01
_STEPS, _RATE = 300, 0.1
# Places of a patch that are tried for its greatest distance from others, each way.
_GRID = 16
# Unbounded coordinates reach that far: places nearer the edges are hardly different.
_REACH = 4.0
# Sensors nearer than this [m] have no direction to part in, and get one by a push that long.
_TOUCHING, _PUSH = 1e-3, 0.02


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
    current = jnp.asarray(free, float)
    if distance > 0 and closest(points(current), bodies, resting) < _TOUCHING:
        # At coincident points the slope is zero.
        current += _PUSH * np.random.default_rng(0).standard_normal(current.shape)
    optimiser = optax.adam(_RATE)
    state = optimiser.init(current)
    for _ in range(_STEPS):
        if closest(points(current), bodies, resting) >= distance:
            break
        change, state = optimiser.update(slope(current), state)
        current = jnp.clip(current + change, -_REACH, _REACH)
    return np.asarray(current)


def farthest(patches: tuple[Patch, ...], resting: Resting) -> Float[np.ndarray, "n n"]:
    """What distance no sensor on one patch exceeds from one on another [m].

    It is the greatest distance of points of a grid, and how far from those others can be: no pair
    that could keep a distance is excluded by it, but some that cannot are not (by some cm).
    """
    world, rest = zip(*(_sampled(patch, resting) for patch in patches), strict=True)
    apart = np.array([[cdist(one, other).max() for other in world] for one in world])
    return apart + np.add.outer(rest, rest)


def _sampled(patch: Patch, resting: Resting) -> tuple[Float[np.ndarray, "g 3"], float]:
    """Points of a patch in the world, evenly, and how far others are from the nearest [m]."""
    edge = 1 / (1 + np.exp(_REACH))
    share = np.linspace(edge, 1 - edge, _GRID)
    even = np.stack(np.meshgrid(share, share, indexing="ij"), -1).reshape(-1, 2)
    low, high = np.array([patch.along, patch.around]).T
    points = jax.vmap(lambda x: board_point(patch, x))(jnp.asarray(low + (high - low) * even))
    world = np.asarray(resting.world(np.full(len(even), patch.body), points))
    grid = world.reshape(_GRID, _GRID, 3)
    # Half a step one way and half a step the other leads from anywhere to a point of the grid.
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).max() for axis in (0, 1)]
    return world, 0.5 * float(sum(steps))
