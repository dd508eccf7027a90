"""Measurement update (Vlasic 2007, eq. 7-9), through a Cholesky factor of the innovations."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Bool, Float

from mocap_jax.kalman.manifold import Manifold
from mocap_jax.kalman.state import State


class Innovation(NamedTuple):
    """What one update saw, for statistics and tuning; inactive entries are zero."""

    residual: Float[Array, "m"]
    """Innovation: measured minus predicted."""
    whitened: Float[Array, "m"]
    """Innovation over its own predicted standard deviation."""
    nis: Float[Array, ""]
    """Normalised innovation squared; its expectation is the number of active entries."""
    log_likelihood: Float[Array, ""]
    accepted: Bool[Array, ""]
    """False when the update was skipped because it was not finite."""


def correct(
    P: Float[Array, "n n"],
    H: Float[Array, "m c"],
    residual: Float[Array, "m"],
    variance: Float[Array, "m"],
    active: Bool[Array, "m"],
    gate: float = 0.0,
) -> tuple[Float[Array, "n"], Float[Array, "n n"], Innovation]:
    """Correction of the mean and covariance after it, in the tangent space of the prior.

    Args:
        P: prior covariance.
        H: measurement Jacobian; it may leave out trailing columns that are zero (c <= n).
        residual: measured minus predicted.
        variance: of the measurement noise, independent between entries.
        active: entries to use; the others may hold anything, NaN included.
        gate: entries whose innovation exceeds this many predicted standard deviations get a
            larger variance, growing with the fourth power of the innovation; 0 switches it off.
            Unlike rejection this lets a filter that has lost track find back.
    """
    columns = H.shape[1]
    H = jnp.where(active[:, None], H, 0.0)
    residual = jnp.where(active, residual, 0.0)
    W = P[:, :columns] @ H.T
    return correct_by_moments(P, W, H @ W[:columns], residual, variance, active, gate)


def correct_by_moments(
    P: Float[Array, "n n"],
    W: Float[Array, "n m"],
    HPH: Float[Array, "m m"],
    residual: Float[Array, "m"],
    variance: Float[Array, "m"],
    active: Bool[Array, "m"],
    gate: float = 0.0,
) -> tuple[Float[Array, "n"], Float[Array, "n n"], Innovation]:
    """`correct`, given the prior's covariance with what is measured and that of the latter.

    Args:
        P: prior covariance.
        W: its covariance with the true values of what is measured; zero where not active.
        HPH: covariance of these values; zero where not active.
        residual: measured minus predicted; zero where not active.
        variance, active, gate: as in `correct`.
    """
    variance = jnp.where(active, variance, 1.0)
    spread = jnp.diagonal(HPH) + variance
    whitened = residual / jnp.sqrt(spread)
    if gate > 0:
        excess = jnp.maximum(whitened**2 / gate**2, 1.0)
        variance = variance + spread * (excess**2 - 1.0)
    S = HPH + jnp.diag(variance)
    L = jnp.linalg.cholesky(S, symmetrize_input=False)
    y, G = _whiten(L, residual), _whiten(L, W.T)
    delta = y @ G
    # Symmetric to rounding. Joseph's form makes the whole filter half as slow again, and differs
    # from it by 1e-11 in double precision.
    P_new = P - G.T @ G
    accepted = jnp.isfinite(P_new).all() & jnp.isfinite(delta).all()
    nis = y @ y
    count = active.sum()
    log_likelihood = -0.5 * (nis + count * jnp.log(2 * jnp.pi)) - jnp.log(jnp.diagonal(L)).sum()
    innovation = Innovation(residual, whitened, nis, log_likelihood, accepted)
    return jnp.where(accepted, delta, 0.0), jnp.where(accepted, P_new, P), innovation


def _whiten(L: Array, x: Array) -> Array:
    column = x.ndim == 1
    x = x[:, None] if column else x
    y = jax.lax.linalg.triangular_solve(L, x, left_side=True, lower=True)
    return y[:, 0] if column else y


def apply(manifold: Manifold, state: State, delta: Array, P: Float[Array, "n n"]) -> State:
    """Move the mean along a correction and carry the covariance to the tangent space there."""
    nv = state.v.shape[0]
    dq = delta[:nv]
    P = P.at[:nv].set(manifold.jacobian(dq, P[:nv]))
    P = P.at[:, :nv].set(manifold.jacobian(dq, P[:, :nv].T).T)
    return apply_mean(manifold, state, delta)._replace(covariance=P)


def apply_mean(manifold: Manifold, state: State, delta: Array) -> State:
    """Move the mean alone."""
    nv = state.v.shape[0]
    return State(
        manifold.retract(state.q, delta[:nv]),
        state.v + delta[nv : 2 * nv],
        state.a + delta[2 * nv :],
        state.covariance,
    )


def update(
    manifold: Manifold,
    state: State,
    H: Float[Array, "m c"],
    residual: Float[Array, "m"],
    variance: Float[Array, "m"],
    active: Bool[Array, "m"],
    gate: float = 0.0,
) -> tuple[State, Innovation]:
    """One measurement update of the belief; arguments as in `correct`."""
    delta, P, innovation = correct(state.covariance, H, residual, variance, active, gate)
    return apply(manifold, state, delta, P), innovation
