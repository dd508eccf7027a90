"""Robust losses: functions rho(s) of a squared whitened norm s, with rho(s) ~ s near zero.

Iteratively reweighted least squares uses the weight rho'(s). Geman-McClure is not convex; its
graduated form (Yang et al. 2020, "Graduated non-convexity") starts near least squares at a large
`mu` and reaches the loss itself at mu = 1.
"""

from __future__ import annotations

from functools import partial
from typing import Literal

import jax
import jax.numpy as jnp
from jax import Array

from mocap_jax.errors import unknown_name

LossName = Literal["none", "huber", "cauchy", "geman_mcclure"]
# Below this whitened square, a loss is the square itself.
_SMALL = 1e-12
LOSSES: tuple[str, ...] = ("none", "huber", "cauchy", "geman_mcclure")


def loss(name: str, squared: Array, scale: float | Array, mu: float | Array = 1.0) -> Array:
    """Value rho(s) of a loss.

    Args:
        name: one of `LOSSES`.
        squared: squared whitened norms s.
        scale: whitened norm beyond which a residual counts as an outlier.
        mu: graduation of `geman_mcclure`, at least 1 (the others ignore it).
    """
    c2 = scale**2
    if name == "none":
        return squared
    if name == "huber":
        outside = squared > c2
        root = jnp.sqrt(jnp.where(outside, squared, c2))
        return jnp.where(outside, 2 * scale * root - c2, squared)
    if name == "cauchy":
        return c2 * jnp.log1p(squared / c2)
    if name == "geman_mcclure":
        return mu * c2 * squared / (mu * c2 + squared)
    raise unknown_name("robust loss", name, LOSSES)


@partial(jax.jit, static_argnums=0, inline=True)
def weight(name: str, squared: Array, scale: float | Array, mu: float | Array = 1.0) -> Array:
    """Derivative rho'(s), the weight of iteratively reweighted least squares."""
    c2 = scale**2
    if name == "none":
        return jnp.ones_like(squared)
    if name == "huber":
        return scale / jnp.sqrt(jnp.maximum(squared, c2))
    if name == "cauchy":
        return 1 / (1 + squared / c2)
    if name == "geman_mcclure":
        return (mu * c2 / (mu * c2 + squared)) ** 2
    raise unknown_name("robust loss", name, LOSSES)


def root_of_weight(whitened: Array, name: str, scale: float | Array) -> Array:
    """Factor (..., 1) on whitened vectors that makes half their square half their robust loss.

    For residuals that a solver takes as they are: a plain least-squares residual times it is
    robust. Like the loss itself it is differentiable everywhere.

    Args:
        whitened: vectors (..., n).
        name: one of `LOSSES`.
        scale: whitened norm beyond which a residual counts as an outlier.
    """
    squared = (whitened**2).sum(-1, keepdims=True)
    large = squared > _SMALL
    safe = jnp.where(large, squared, 1.0)
    return jnp.where(large, jnp.sqrt(loss(name, safe, scale) / safe), 1.0)
