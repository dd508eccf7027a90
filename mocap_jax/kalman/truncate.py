"""A Gaussian belief cut off at a bound of one coordinate (density truncation).

Simon and Simon 2010, "Constrained Kalman filtering via density function truncation for turbofan
engine health estimation" (Int. J. Systems Science 41): the belief is replaced by the Gaussian
that has the mean and the covariance of the cut one.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jax.scipy.special import log_ndtr
from jaxtyping import Float, Int

# A belief wholly beyond its bound is drawn back from here on as from here [deviations].
_FURTHEST = 30.0
# The density's cut takes no more of the variance than this leaves.
_LEAST = 1e-3


def truncate(
    P: Float[Array, "n n"],
    at: Int[Array, ""],
    room: Float[Array, ""],
) -> tuple[Float[Array, "n"], Float[Array, "n n"]]:
    """Cut off where coordinate `at` is below its mean less `room`.

    Args:
        P: covariance.
        at: the coordinate.
        room: how far its mean is above the bound; negative beyond it, infinite without a bound.

    Returns:
        Shift of the mean of all coordinates, and the covariance.
    """
    bounded = jnp.isfinite(room)
    # Derivatives would be NaN where infinities only meet a factor of zero.
    room = jnp.where(bounded, room, 0.0)
    sigma = jnp.sqrt(jnp.maximum(P[at, at], jnp.finfo(P.dtype).tiny))
    z = jnp.clip(-room / sigma, -_FURTHEST, _FURTHEST)
    hazard = jnp.exp(-0.5 * z * z - 0.5 * jnp.log(2 * jnp.pi) - log_ndtr(-z))
    left = jnp.clip(1 + hazard * (z - hazard), _LEAST, 1.0)
    # Beyond `_FURTHEST` the mean goes to the bound, and not only by the hazard.
    shift = jnp.where(-room > _FURTHEST * sigma, -room, sigma * hazard)
    gain = P[:, at] / sigma
    cut = P - (1 - left) * gain[:, None] * gain
    return jnp.where(bounded, gain * shift / sigma, 0.0), jnp.where(bounded, cut, P)
