"""Where on their segments sensors sit best: Adam from several starts, over the whole sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
from mocap_jax.placement.spacing import Resting, closest, crowding, kept_apart
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
    closest: float
    """Least distance between two sensors [m]."""


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
        distance: least distance between two sensors [m]; less only where no place keeps it.
        size: number of boards that evaluations are compiled for.
        report: called after every step.
    """
    surfaces = Surfaces(patches)
    best: Found | None = None
    for free in starts(len(patches), options):
        found = _descend(criterion, surfaces, resting, free, options, distance, size, report)
        kept = found.closest >= distance
        if best is None or (not kept, found.value) < (best.closest < distance, best.value):
            best = found
    assert best is not None
    return best


def starts(sensors: int, options: SearchOptions) -> Iterator[Float[np.ndarray, "n 2"]]:
    """Unbounded coordinates that searches start from, those of the patches' middles first."""
    generator = np.random.default_rng(options.seed)
    yield np.zeros((sensors, 2))
    for _ in range(options.restarts - 1):
        yield _SPREAD * generator.standard_normal((sensors, 2))


def _descend(
    criterion: Criterion, surfaces: Surfaces, resting: Resting, free: np.ndarray,
    options: SearchOptions, distance: float, size: int, report: Callable[[], object],
) -> Found:  # fmt: skip
    optimiser = optax.adam(options.learning_rate)
    bodies = np.array([p.body for p in surfaces.patches])
    current = jnp.asarray(kept_apart(surfaces, resting, free, distance))
    state = optimiser.init(current)
    best, best_rank, history = current, (True, np.inf), []
    for step in range(options.steps + 1):
        value, cost, slope = _cost_and_slope(criterion, surfaces, resting, current, distance, size)
        history.append(value)
        report()
        near = closest(surfaces.points(surfaces.places(current)), bodies, resting)
        if (rank := (near < distance, cost)) < best_rank:
            best, best_rank, best_value, apart = current, rank, value, near
        if step < options.steps:
            change, state = optimiser.update(slope, state)
            current = jnp.clip(current + change, -4.0, 4.0)
    return Found(np.asarray(surfaces.places(best)), best_value, tuple(history), apart)


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


def value_of(
    criterion: Criterion, patches: tuple[Patch, ...], places: np.ndarray, size: int
) -> Evaluation:
    """Evaluate sensors at places."""
    points = Surfaces(patches).points(jnp.asarray(places))
    return criterion.evaluate(boards_on(patches, points, size))
