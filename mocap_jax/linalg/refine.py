"""Iterative refinement of an arrow solve against a gradient that is better than the matrix.

The normal equations J'J square the condition number of J. A root seen through accelerations alone
has one that grows like the square of the number of frames, so J'J loses the slow drifts in
rounding: its factor still is a good preconditioner, not a good solution. Where the product
J'(r + J x) can be formed from J itself, corrections by that factor bring the step back to the
accuracy of an orthogonal factorisation (Bjorck 1987, corrected semi-normal equations).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.linalg.arrow import ArrowFactor, BorderBlocks, solve

ModelGradient = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""(x (t, d), z (m,)) -> gradient of the quadratic model there, J'(r + J (x, z)), same shapes."""


@dataclass(frozen=True)
class Refined:
    """A refined solution and how much was corrected."""

    x: Float[np.ndarray, "t d"]
    z: Float[np.ndarray, "m"]
    corrections: tuple[float, ...]
    """Size of each correction over that of the solution, in the norm named in `refine`."""

    @property
    def error(self) -> float:
        """Estimated relative error of the solution: the last correction times its contraction."""
        if len(self.corrections) < 2:
            return self.corrections[-1] if self.corrections else np.inf
        before, last = self.corrections[-2:]
        return last * min(1.0, last / before) if before else last


def refine(
    f: ArrowFactor,
    border: BorderBlocks | None,
    gradient: ModelGradient,
    x: Float[np.ndarray, "t d"],
    z: Float[np.ndarray, "m"],
    *,
    tolerance: float = 1e-8,
    max_corrections: int = 6,
) -> Refined:
    """Correct (x, z) until the next correction would be negligible.

    Sizes are maximum norms over the tangent coordinates as they are [rad, m].

    Args:
        f: factor of (rounded) J'J, damping included.
        border: the blocks of B' that were factored.
        gradient: gradient of the quadratic model, damping included.
        x: solution of the frames' unknowns to start from.
        z: of the constants.
        tolerance: relative size of the next correction, as foreseen from the contraction, at
            which to stop.
        max_corrections: largest number of corrections.

    Returns:
        The best solution seen. Corrections that grow are not applied: `Refined.error` then says
        that the factor is too poor to help.
    """
    sizes: list[float] = []
    for _ in range(max_corrections):
        slope, slope_z = gradient(x, z)
        dx, dz = solve(f, -slope, -slope_z, border)
        size = _largest(dx, dz) / max(_largest(x + dx, z + dz), 1e-300)
        if not np.isfinite(size) or (sizes and size > 2 * sizes[-1]):
            return Refined(x, z, (*sizes, size))
        x, z = x + dx, z + dz
        sizes.append(size)
        if Refined(x, z, tuple(sizes)).error < tolerance:
            break
    return Refined(x, z, tuple(sizes))


def _largest(x: np.ndarray, z: np.ndarray) -> float:
    return max(float(np.abs(x).max(initial=0.0)), float(np.abs(z).max(initial=0.0)))
