"""The optimiser's corrections of averaged samples, traced: see `residuals.inertial`."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Bool, Float


def de_averaged(
    samples: Float[Array, "t s 3"], known: Bool[Array, "t s 3"]
) -> Float[Array, "t s 3"]:
    """`residuals.inertial.de_average` where missing samples are zero and not `known`."""
    samples = jnp.asarray(samples)
    correction = (samples[:-2] - 2 * samples[1:-1] + samples[2:]) / 24
    whole = known[:-2] & known[1:-1] & known[2:]
    return samples.at[1:-1].add(-jnp.where(whole, correction, 0.0))


def interval_means(
    rates: Float[Array, "t s 3"], known: Bool[Array, "t s 3"]
) -> Float[Array, "t s 3"]:
    """`residuals.inertial.mean_rate` likewise; zero where it cannot be formed."""
    inner = jnp.where(known[:-1] & known[1:], (rates[:-1] + rates[1:]) / 2, 0.0)
    outer = (rates[:-3] + rates[3:] - rates[1:-2] - rates[2:-1]) / 24
    whole = known[:-3] & known[1:-2] & known[2:-1] & known[3:]
    inner = inner.at[1:-1].add(-jnp.where(whole, outer, 0.0))
    return jnp.concatenate([inner, jnp.zeros_like(rates[:1])])
