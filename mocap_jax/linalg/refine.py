"""Solve an arrow system to the accuracy of J when J'J has lost it.

The normal equations J'J square the condition number of J. A root seen through accelerations alone
has one that grows like the square of the number of frames, so J'J loses the slow drifts in
rounding, and its factor is a preconditioner rather than a solution. Conjugate directions with
products formed from J itself, J'(J x), bring the step to the accuracy of an orthogonal
factorisation; they also remove the effect of a shift that made J'J positive definite again, in
about as many iterations as there are modes below the shift (Bjorck 1996, ch. 7).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import SolveError
from mocap_jax.linalg.arrow import ArrowFactor, BorderBlocks, factor
from mocap_jax.linalg.arrow_solve import solve

_EPS = float(np.finfo(float).eps)


class Model(Protocol):
    """The quadratic model of a least-squares problem, from J and not from J'J."""

    def __call__(
        self, x: np.ndarray, z: np.ndarray, *, offset: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """J'(r + J (x, z)), or J'J (x, z) without `offset`; damping included in both.

        x has shape (t, d), z (m,), and so have the results.
        """
        ...


@dataclass(frozen=True)
class Refined:
    """A refined solution, and how it came about."""

    x: Float[np.ndarray, "t d"]
    z: Float[np.ndarray, "m"]
    steps: tuple[float, ...]
    """Size of every step over that of the solution (largest entries, rad and m alike)."""
    converged: bool
    """Whether the last two steps were below the tolerance, or a first one small enough."""


def shifted_factor(
    lower: np.ndarray,
    corner: np.ndarray | None = None,
    border: BorderBlocks | None = None,
    *,
    damping: float = 0.0,
    attempts: int = 6,
    least: float = 1.0,
) -> tuple[ArrowFactor, float]:
    """Factor an arrow matrix, shifted by as little as makes it positive definite in rounding.

    Args:
        lower: as for `factor`; not overwritten.
        corner: as for `factor`.
        border: as for `factor`.
        damping: asked for in any case.
        attempts: number of shifts to try; each is ten times the one before.
        least: the first of them, in units of the rounding error of the largest diagonal element.

    Returns:
        The factor and the diagonal that was added beyond `damping` (0 if none was needed).

    Raises:
        SolveError: not even the largest shift helped.
    """
    largest = float(np.diagonal(lower[:, 0], axis1=1, axis2=2).max())
    *shifts, last = (0.0, *(_EPS * largest * least * 10.0**i for i in range(attempts)))
    for shift in shifts:
        try:
            return factor(lower, corner, border, damping=damping + shift), shift
        except SolveError:
            continue
    return factor(lower, corner, border, damping=damping + last), last


def refine(
    f: ArrowFactor,
    border: BorderBlocks | None,
    model: Model,
    x: Float[np.ndarray, "t d"],
    z: Float[np.ndarray, "m"],
    *,
    tolerance: float = 1e-8,
    nearly: float = 1e-5,
    max_iterations: int = 25,
) -> Refined:
    """Minimise the quadratic model by conjugate directions, preconditioned by a rounded factor.

    The gradient is formed anew in every iteration, and every direction is made conjugate to all
    before it: the short recursion of conjugate gradients forgets the few weak directions (a root's
    drift) that this is for, and stagnates a thousand times further off. Where the first correction
    is below `nearly` of the solution, rounding has lost little, and that correction is all: it
    leaves about the square of that.

    Args:
        f: factor of (rounded, perhaps shifted) J'J, damping included.
        border: the blocks of B' that were factored.
        model: products with J.
        x: the frames' unknowns to start from, usually the plain solution.
        z: the constants.
        tolerance: relative size of a step below which two steps in a row end the iteration.
        nearly: relative size of a first correction that is enough.
        max_iterations: largest number of steps; each costs two products and one solve, and keeps
            two vectors.
    """
    size = x.size
    join = lambda a, b: np.concatenate([a.ravel(), b])  # noqa: E731

    def call(v: np.ndarray, *, offset: bool) -> np.ndarray:
        return join(*model(v[:size].reshape(x.shape), v[size:], offset=offset))

    def precondition(v: np.ndarray) -> np.ndarray:
        return join(*solve(f, v[:size].reshape(x.shape), v[size:], border))

    steps: list[float] = []
    at, directions = join(x, z), _Conjugate()
    while len(steps) < max_iterations:
        residual = -call(at, offset=True)
        direction = directions.conjugate(precondition(residual))
        first = _largest(direction) / max(_largest(at), 1e-300)
        if not steps and first < nearly:
            at = at + direction
            return Refined(at[:size].reshape(x.shape), at[size:], (first,), True)
        image = call(direction, offset=False)
        curvature = float(direction @ image)
        if not curvature > 0:
            break
        directions.add(direction, image, curvature)
        step = float(direction @ residual) / curvature * direction
        at = at + step
        steps.append(_largest(step) / max(_largest(at), 1e-300))
        if max(steps[-2:]) < tolerance and len(steps) > 1:
            break
    done = len(steps) > 1 and max(steps[-2:]) < tolerance
    return Refined(at[:size].reshape(x.shape), at[size:], tuple(steps), done)


class _Conjugate:
    """Directions d_i with d_i'H d_j = 0."""

    def __init__(self) -> None:
        self._kept: list[tuple[np.ndarray, np.ndarray, float]] = []

    def add(self, direction: np.ndarray, image: np.ndarray, curvature: float) -> None:
        """Keep d, H d and d'H d."""
        self._kept.append((direction, image, curvature))

    def conjugate(self, v: np.ndarray) -> np.ndarray:
        """What of v is conjugate to all kept directions (twice, against rounding)."""
        for _ in range(2):
            for direction, image, curvature in self._kept:
                v = v - float(v @ image) / curvature * direction
        return v


def _largest(v: np.ndarray) -> float:
    return float(np.abs(v).max(initial=0.0))
