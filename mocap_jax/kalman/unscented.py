"""The scaled unscented transform (Julier 2002), and time and measurement updates by it.

A belief is carried through a function by points at its mean and at `spread` standard deviations
along the columns of a square root of its covariance, in the tangent space of the pose.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Bool, Float

from mocap_jax.errors import InputError
from mocap_jax.kalman.manifold import Manifold
from mocap_jax.kalman.predict import Dynamics, Process, advance, with_noise
from mocap_jax.kalman.state import State
from mocap_jax.kalman.update import Innovation, apply, apply_mean, correct_by_moments


@dataclass(frozen=True)
class SigmaPoints:
    """Where the points are and how they count."""

    spread: float = 3.0**0.5
    """Distance of the points from the mean in standard deviations: the scaled transform's
    alpha sqrt(n + kappa), with kappa = 0. The root of 3 gives each axis a Gaussian's fourth
    moment (Julier and Uhlmann 2004), however many axes there are."""
    beta: float | None = None
    """What the centre counts more in covariances than in means, less 1 - alpha^2; None: alpha^2,
    the least that never makes a covariance negative. The often recommended 2 is right for
    curvature in one coordinate and a small spread; curvature in n of them it counts n times."""

    def __post_init__(self) -> None:
        if not self.spread > 0:
            raise InputError(f"spread={self.spread:g}: must be above 0 standard deviations")
        # The smallest state has three coordinates: then covariances cannot become negative.
        if self.beta is not None and not self.beta >= self.spread**2 / 3:
            raise InputError(
                f"beta={self.beta:g}: must be at least spread^2 / 3 = {self.spread**2 / 3:.3g}"
            )


class Moments(NamedTuple):
    """Of f(x), where x is a Gaussian about zero."""

    mean: Float[Array, "m"]
    covariance: Float[Array, "m m"]
    cross: Float[Array, "n m"]
    """Covariance of x with f(x)."""


def unscented_moments(
    function: Callable[[Array], Array],
    P: Float[Array, "n n"],
    points: SigmaPoints,
    columns: int | None = None,
) -> Moments:
    """Mean, covariance and cross-covariance of a function of a Gaussian about zero.

    Args:
        function: (n,) to (m,).
        P: covariance of its argument.
        points: the sigma points.
        columns: the function depends on this many leading coordinates only; the others' points
            change nothing and are left out.

    With y+, y-, y0 the values at a pair and at the centre, and h the spread, the textbook's
    weighted sums are mean - y0 = m = sum (y+ + y- - 2 y0) / 2 h^2, and the covariance
    sum (d d' + s s') / 4 h^2 + (beta - h^2 / n) m m' with d = y+ - y-, s = y+ + y- - 2 y0. Written
    so nothing large cancels, and with beta >= h^2 / n it cannot be negative.
    """
    n, h2 = P.shape[0], points.spread**2
    offsets = points.spread * _root(P).T[:columns]
    centre = function(jnp.zeros(n, P.dtype))
    ahead, behind = jax.vmap(function)(offsets), jax.vmap(function)(-offsets)
    d, s = ahead - behind, ahead + behind - 2 * centre
    shift = s.sum(0) / (2 * h2)
    covariance = (d.T @ d + s.T @ s) / (4 * h2)
    if points.beta is not None:
        covariance = covariance + (points.beta - h2 / n) * shift[:, None] * shift
    return Moments(centre + shift, covariance, offsets.T @ d / (2 * h2))


def _root(P: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Lower Cholesky factor, through the correlations: variances differ by many powers."""
    deviation = jnp.sqrt(jnp.maximum(jnp.diagonal(P), 0.0))
    safe = jnp.where(deviation > 0, deviation, 1.0)
    correlation = P / safe[:, None] / safe
    # Coordinates known exactly have none; rounding must not make the others negative.
    ridge = 4 * P.shape[0] * jnp.finfo(P.dtype).eps + jnp.where(deviation > 0, 0.0, 1.0)
    L = jnp.linalg.cholesky(correlation + jnp.diag(ridge), symmetrize_input=False)
    return deviation[:, None] * L


def predict_unscented(
    manifold: Manifold, process: Process, dynamics: Dynamics, state: State, points: SigmaPoints
) -> State:
    """Advance the belief by one step (compare `predict`)."""
    centre = advance(manifold, process, dynamics, state)

    def image(offset: Array) -> Array:
        moved = advance(manifold, process, dynamics, apply_mean(manifold, state, offset))
        dq = manifold.difference(centre.q, moved.q)
        return jnp.concatenate([dq, moved.v - centre.v, moved.a - centre.a])

    found = unscented_moments(image, state.covariance, points)
    return apply(manifold, centre, found.mean, with_noise(dynamics, found.covariance))


def update_unscented(
    manifold: Manifold,
    state: State,
    residual: Callable[[State], Array],
    variance: Float[Array, "m"],
    active: Bool[Array, "m"],
    points: SigmaPoints,
    gate: float = 0.0,
    columns: int | None = None,
) -> tuple[State, Innovation]:
    """One measurement update of the belief (compare `update`).

    Args:
        manifold: of the poses.
        state: prior belief.
        residual: measured minus predicted at any state, (m,); for rotations the rotation vector
            from the predicted to the measured one, so that predictions need no mean of their own.
        variance: of the measurement noise, independent between entries.
        active: entries to use; the others may hold anything, NaN included.
        points: the sigma points.
        gate: as in `correct`.
        columns: the residual depends on this many leading tangent coordinates only.
    """

    def at(offset: Array) -> Array:
        return jnp.where(active, residual(apply_mean(manifold, state, offset)), 0.0)

    found = unscented_moments(at, state.covariance, points, columns)
    delta, P, innovation = correct_by_moments(
        state.covariance, -found.cross, found.covariance, found.mean, variance, active, gate
    )
    return apply(manifold, state, delta, P), innovation
