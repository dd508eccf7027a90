"""Where on their segments sensors sit best: Adam from several starts, over the whole sequence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import Array
from jaxtyping import Float

from mocap_jax.placement.evaluation import Criterion, Evaluation
from mocap_jax.placement.options import SearchOptions
from mocap_jax.placement.rows import Boards
from mocap_jax.placement.surface import Patch, Surfaces

# Spread of the random starts in the unbounded coordinates (half of a patch's area).
_SPREAD = 1.2
# Weight of the penalty on sensors closer than allowed, relative to the criterion, per (share)^2.
_PENALTY = 10.0


@dataclass(frozen=True)
class Found:
    """A locally best set of places."""

    places: Float[np.ndarray, "n 2"]
    """Share of each patch's axis and angle [rad]."""
    value: float
    history: tuple[float, ...]
    """Criterion at every step of the best start."""


@dataclass(frozen=True)
class Resting:
    """Frames of segments in the reference pose, where distances are checked."""

    rotation: Float[np.ndarray, "b 3 3"]
    position: Float[np.ndarray, "b 3"]


def boards_on(
    patches: tuple[Patch, ...], points: Float[Array, "n 3"], size: int | None = None
) -> Boards:
    """Boards at points of patches, filled up with unused ones to a given number.

    One size means one compiled program for sets of different sizes.
    """
    spare = (size or len(patches)) - len(patches)
    body = [p.body for p in patches] + [patches[0].body] * spare
    filled = jnp.concatenate([jnp.asarray(points), jnp.zeros((spare, 3))])
    weight = jnp.concatenate([jnp.ones(len(patches)), jnp.zeros(spare)])
    return Boards(jnp.asarray(body), filled, weight)


def refine(
    criterion: Criterion,
    patches: tuple[Patch, ...],
    resting: Resting,
    options: SearchOptions,
    *,
    distance: float,
    size: int,
    report: Callable[[], object] = lambda: None,
) -> Found:
    """Move sensors within their patches to a local minimum of the criterion.

    Args:
        criterion: of the study.
        patches: one for each sensor.
        resting: reference pose.
        options: starts, steps, learning rate.
        distance: least distance between two sensors [m].
        size: number of boards that evaluations are compiled for.
        report: called after every step.
    """
    surfaces = Surfaces(patches)
    generator = np.random.default_rng(options.seed)
    best: Found | None = None
    for start in range(options.restarts):
        free = np.zeros((len(patches), 2))
        if start:
            free = _SPREAD * generator.standard_normal(free.shape)
        found = _descend(criterion, surfaces, resting, free, options, distance, size, report)
        if best is None or found.value < best.value:
            best = found
    assert best is not None
    return best


def _descend(
    criterion: Criterion, surfaces: Surfaces, resting: Resting, free: np.ndarray,
    options: SearchOptions, distance: float, size: int, report: Callable[[], object],
) -> Found:  # fmt: skip
    optimiser = optax.adam(options.learning_rate)
    current = jnp.asarray(free)
    state = optimiser.init(current)
    best, best_cost, history = current, np.inf, []
    for step in range(options.steps + 1):
        value, cost, slope = _cost_and_slope(criterion, surfaces, resting, current, distance, size)
        history.append(value)
        report()
        if cost < best_cost:
            best, best_cost, best_value = current, cost, value
        if step < options.steps:
            change, state = optimiser.update(slope, state)
            current = jnp.clip(current + change, -4.0, 4.0)
    return Found(np.asarray(surfaces.places(best)), best_value, tuple(history))


def _cost_and_slope(
    criterion: Criterion, surfaces: Surfaces, resting: Resting, free: Array, distance: float,
    size: int,
) -> tuple[float, float, Array]:  # fmt: skip
    """Criterion, logarithm of it with penalty, and the slope of that."""
    points, pull = jax.vjp(lambda f: surfaces.points(surfaces.places(f)), free)
    boards = boards_on(surfaces.patches, points, size)
    evaluation = criterion.evaluate(boards)
    slope = criterion.slope(boards, evaluation)[: len(points)] / evaluation.value
    bodies = np.array([p.body for p in surfaces.patches])
    penalty, push = jax.value_and_grad(lambda x: _PENALTY * crowding(x, bodies, resting, distance))(
        points
    )
    (total,) = pull(jnp.asarray(slope) + push)
    return evaluation.value, float(np.log(evaluation.value) + penalty), total


def crowding(
    points: Float[Array, "n 3"], bodies: np.ndarray, resting: Resting, distance: float
) -> Float[Array, ""]:
    """Sum of squared shares by which sensors are closer than allowed; 0 where none is."""
    world = resting.position[bodies] + jnp.einsum("nij,nj->ni", resting.rotation[bodies], points)
    first, second = np.triu_indices(len(bodies), 1)
    apart = jnp.sqrt(((world[first] - world[second]) ** 2).sum(-1) + 1e-12)
    return (jnp.maximum(1 - apart / distance, 0.0) ** 2).sum() if distance > 0 else jnp.zeros(())


def value_of(
    criterion: Criterion, patches: tuple[Patch, ...], places: np.ndarray, size: int
) -> Evaluation:
    """Evaluate sensors at places."""
    points = Surfaces(patches).points(jnp.asarray(places))
    return criterion.evaluate(boards_on(patches, points, size))
