"""A self-check for authors of residuals: JAX's derivative against central differences."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, retract
from mocap_jax.errors import InputError
from mocap_jax.estimate.sequence.user_residuals import UserResidual

_STEP = 1e-6


@dataclass(frozen=True)
class DerivativeReport:
    """What `check_residual` found."""

    jacobian: Float[np.ndarray, "m w nv"]
    """By JAX."""
    difference: Float[np.ndarray, "m w nv"]
    """JAX less central differences."""
    tolerance: float

    @property
    def worst(self) -> float:
        """Largest difference, relative to the largest entry of the Jacobian (at least 1)."""
        scale = max(1.0, float(np.abs(self.jacobian).max(initial=0.0)))
        return float(np.abs(self.difference).max(initial=0.0)) / scale

    @property
    def ok(self) -> bool:
        """Whether the two agree."""
        return self.worst <= self.tolerance

    def __str__(self) -> str:
        row, frame, dof = np.unravel_index(np.abs(self.difference).argmax(), self.difference.shape)
        verdict = "agrees with" if self.ok else "DIFFERS from"
        return (
            f"derivative {verdict} central differences: worst {self.worst:.2e} "
            f"(tolerance {self.tolerance:.0e}) at component {row}, frame {frame}, "
            f"degree of freedom {dof}"
        )


def check_residual(
    residual: UserResidual,
    body: Body,
    q_window: Float[np.ndarray, "w nq"],
    data: Any = None,
    *,
    tolerance: float = 1e-6,
) -> DerivativeReport:
    """Check the derivative of a user's residual at some poses.

    Args:
        residual: the residual.
        body: the body it will be used with.
        q_window: poses of `residual.window` successive frames, not all alike.
        data: one row of its data.
        tolerance: largest relative difference that passes.

    Raises:
        InputError: the window has the wrong shape, or value or derivative is not finite or not a
            vector.
    """
    expected = (residual.window, body.nq)
    if np.shape(q_window) != expected:
        raise InputError(
            f"residual '{residual.name}': q_window has shape {np.shape(q_window)}, "
            f"expected {expected} (window, nq)"
        )
    poses = jnp.asarray(q_window)

    def value(delta: jax.Array) -> jax.Array:
        moved = jax.vmap(lambda q, d: retract(body.topology, q, d))(poses, delta)
        return residual.function(body, moved, data)

    zero = jnp.zeros((residual.window, body.nv))
    here = np.asarray(value(zero))
    if here.ndim != 1:
        raise InputError(
            f"residual '{residual.name}' must return a vector (m,), not shape {here.shape}"
        )
    jacobian = np.asarray(jax.jacfwd(value)(zero))
    if not (np.isfinite(here).all() and np.isfinite(jacobian).all()):
        raise InputError(
            f"residual '{residual.name}': its value or derivative is not finite at these poses "
            "(guard square roots and divisions with jnp.where before the arithmetic)"
        )
    numeric = np.empty_like(jacobian)
    compiled = jax.jit(value)
    for at in np.ndindex(zero.shape):
        ahead, behind = compiled(zero.at[at].set(_STEP)), compiled(zero.at[at].set(-_STEP))
        numeric[(slice(None), *at)] = (np.asarray(ahead) - np.asarray(behind)) / (2 * _STEP)
    return DerivativeReport(jacobian, jacobian - numeric, tolerance)
