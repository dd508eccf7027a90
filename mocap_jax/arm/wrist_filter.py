"""The unscented Kalman filter on the wrist position (the paper's eq. 10 to 16).

The printed eq. 13 and 15 leave out Q and V, although eq. 10 has both; they are added here, for
without them the covariance collapses.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.errors import InputError


@dataclass(frozen=True)
class WristFilterOptions:
    """Options of `wrist_filter`. The paper prints no figure for any of them."""

    step_sigma: float = 0.01
    """Movement of the wrist from pulse to pulse, per axis: the root of Q [m]. 1 cm in 20 ms is a
    hand at 0.5 m/s."""
    range_sigma: float = 0.003
    """Noise of ranges: the root of V [m]."""
    start_sigma: float = 0.1
    """Of the first position, per axis [m]."""
    scaling: float = 1.0
    """The paper's lambda: points lie sqrt(n + lambda) deviations from the mean. The default makes
    that the root of three for two coordinates."""

    def __post_init__(self) -> None:
        for name in ("step_sigma", "range_sigma", "start_sigma"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name}={getattr(self, name):g}: must be above 0 m")
        if not self.scaling > -2:
            raise InputError(f"scaling={self.scaling:g}: must be above -2, minus the coordinates")


class WristEstimate(NamedTuple):
    """Wrist positions and their covariances."""

    position: Float[Array, "t n"]
    """[m]"""
    covariance: Float[Array, "t n n"]
    log_likelihood: Float[Array, ""]
    """Of all innovations: what noise figures are tuned by."""


def wrist_filter(
    ranges: Float[Array, "t k"],
    anchors: Float[Array, "k 2"],
    start: Float[Array, "2"],
    aside: Float[Array, "k"] | None = None,
    options: WristFilterOptions = WristFilterOptions(),
) -> WristEstimate:
    """Track the wrist in its plane.

    Args:
        ranges: to every anchor [m]; NaN where one heard nothing.
        anchors: positions in the plane (x, y) [m].
        start: first guess of the wrist's position [m].
        aside: distance of each anchor from the plane, zero in eq. 11 [m].
        options: see `WristFilterOptions`.
    """
    aside = jnp.zeros(len(anchors)) if aside is None else aside
    arrays = (jnp.asarray(x, float) for x in (ranges, anchors, start, aside))
    return _run(options, *arrays)


@partial(jax.jit, static_argnums=0)
def _run(
    options: WristFilterOptions, ranges: Array, anchors: Array, start: Array, aside: Array
) -> WristEstimate:
    n = start.shape[0]
    weights = jnp.full(2 * n + 1, 0.5 / (n + options.scaling))
    weights = weights.at[0].set(options.scaling / (n + options.scaling))

    def h(X: Array) -> Array:
        """Eq. 11, for one position."""
        return jnp.sqrt(((X - anchors) ** 2).sum(-1) + aside**2)

    def points(X: Array, P: Array) -> Array:
        """Eq. 12."""
        B = jnp.linalg.cholesky((n + options.scaling) * P)
        return jnp.concatenate([X[None], X + B.T, X - B.T])

    def step(belief: tuple[Array, Array], Y: Array) -> tuple[tuple, tuple]:
        X, P = belief
        chi = points(X, P)  # eq. 13, with Q
        X = weights @ chi
        P = (weights[:, None] * (chi - X)).T @ (chi - X) + options.step_sigma**2 * jnp.eye(n)
        chi = points(X, P)  # eq. 14
        expected = jax.vmap(h)(chi)
        mean = weights @ expected
        heard = jnp.isfinite(Y)
        away = jnp.where(heard, expected - mean, 0.0)
        V = jnp.where(heard, options.range_sigma**2, 1.0)
        Pyy = (weights[:, None] * away).T @ away + jnp.diag(V)  # eq. 15, with V
        Pxy = (weights[:, None] * (chi - X)).T @ away
        K = jnp.linalg.solve(Pyy, Pxy.T).T
        X = X + K @ jnp.where(heard, Y - mean, 0.0)  # eq. 16
        P = P - K @ Pyy @ K.T
        belief = X, 0.5 * (P + P.T)
        seen = jnp.where(heard, Y - mean, 0.0)
        spread = jnp.linalg.slogdet(2 * jnp.pi * Pyy)[1]
        # Absent ranges stand in Pyy as one each.
        spread = spread - (~heard).sum() * jnp.log(2 * jnp.pi)
        told = -0.5 * (seen @ jnp.linalg.solve(Pyy, seen) + spread)
        return belief, (*belief, told)

    _, (position, covariance, told) = jax.lax.scan(
        step, (start, options.start_sigma**2 * jnp.eye(n)), ranges
    )
    return WristEstimate(position, covariance, told.sum())
