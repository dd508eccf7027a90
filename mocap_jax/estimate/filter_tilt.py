"""Gravity reference in the filter: the update by boards that do not accelerate."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.measurement.predict import Prediction
from mocap_jax.residuals.gravity import direction, tilt_error

# Variances that beliefs would make smaller than this are none [rad^2].
_LEAST = 1e-12


def tilt_update(
    predicted: Prediction, force: Float[Array, "s 3"], active: Float[Array, "s"],
    gravity: Float[Array, "3"], figures: Float[Array, "4"], covariance: Float[Array, "n n"],
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Jacobian, residual, variance and activity of the tilt of boards, two values each.

    As of headings by magnetometers, the belief does not know that biases of rates drift, and tilt
    with them: taken at its word it would hardly be corrected, so that the variance is held to what
    corrects it in time.

    Args:
        predicted: orientations of the sensors.
        force: what they feel; NaN where it is not gravity alone [m/s^2].
        active: where it is. Only these share the correction: others may move.
        gravity: world frame [m/s^2].
        figures: see `Parameters.gravity`.
        covariance: of the pose.
    """
    up = -gravity / jnp.linalg.norm(gravity)
    felt = jnp.where(active[:, None], force, jnp.array([0.0, 0.0, 1.0], up.dtype))
    # Nothing is told about turns about the vertical: a value of its own would be zero always, and
    # its variance a part of the likelihood that no reading informs.
    level = _level(up)
    error = tilt_error(predicted.value, felt, up) @ level.T
    across = so3.skew(direction(predicted.value, felt))
    slope = -(level @ so3.skew(up)) @ across @ predicted.value @ predicted.jacobian
    sigma, shared, pull, scale = figures
    believed = jnp.einsum("sia,ab,sib->s", slope, covariance, slope) / 2
    still = jnp.maximum(active.sum(dtype=up.dtype), 1.0)
    in_time = jnp.maximum(still * pull * believed, _LEAST)
    doubt = 1 + (error**2).sum(-1) / (scale * sigma) ** 2
    variance = jnp.minimum(shared * sigma**2, in_time) * doubt
    spread = lambda x: jnp.broadcast_to(x[:, None], error.shape).reshape(-1)  # noqa: E731
    return slope.reshape(-1, slope.shape[-1]), -error.reshape(-1), spread(variance), spread(active)


def _level(up: Float[Array, "3"]) -> Float[Array, "2 3"]:
    """Two horizontal axes, at right angles (x and y of the world where z is up)."""
    least = jnp.eye(3, dtype=up.dtype)[jnp.argmin(jnp.abs(up))]
    first = least - up * (up @ least)
    first = first / jnp.linalg.norm(first)
    return jnp.stack([first, so3.cross(up, first)])
