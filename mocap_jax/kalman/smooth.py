"""Backward pass of Rauch, Tung and Striebel (1965), on a manifold."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.kalman.manifold import Manifold
from mocap_jax.kalman.predict import Dynamics, Process, predict, transition
from mocap_jax.kalman.state import State
from mocap_jax.kalman.update import apply, apply_mean


def smooth_step(
    manifold: Manifold,
    process: Process,
    dynamics: Dynamics,
    filtered: State,
    smoothed_next: State,
    covariance: bool = True,
) -> State:
    """Belief at one frame given all data, from the filtered one and the next smoothed one.

    Without `covariance` it keeps the filtered one's, which the mean does not depend on: that is
    three times as fast.
    """
    if covariance:
        return smooth_pair(manifold, process, dynamics, filtered, smoothed_next)[0]
    _, error, solve, FP = _gain(manifold, process, dynamics, filtered, smoothed_next)
    return apply_mean(manifold, filtered, FP.T @ solve(error[:, None])[:, 0])


def smooth_pair(
    manifold: Manifold,
    process: Process,
    dynamics: Dynamics,
    filtered: State,
    smoothed_next: State,
) -> tuple[State, Float[Array, "nv nv"]]:
    """`smooth_step`, and the covariance of the next pose (rows) with this one (columns).

    The latter is P_next G' with the gain G (Rauch, Tung and Striebel 1965), each pose's error in
    the tangent space at its smoothed estimate.
    """
    nv = filtered.v.shape[0]
    predicted, error, solve, FP = _gain(manifold, process, dynamics, filtered, smoothed_next)
    gain, dq = solve(FP).T, error[:nv]
    # The next covariance lies in the tangent space at the smoothed pose: bring it to the
    # predicted one, where the gain is defined.
    P_next = smoothed_next.covariance
    P_next = P_next.at[:nv].set(manifold.jacobian_inverse(dq, P_next[:nv]))
    P_next = P_next.at[:, :nv].set(manifold.jacobian_inverse(dq, P_next[:, :nv].T).T)
    P = filtered.covariance + gain @ (P_next - predicted.covariance) @ gain.T
    delta = gain @ error
    # The next pose's own error stays where it is: only its other side is brought over.
    pair = manifold.jacobian(dq, P_next[:nv]) @ gain[:nv].T
    pair = manifold.jacobian(delta[:nv], pair.T).T
    return apply(manifold, filtered, delta, 0.5 * (P + P.T)), pair


_Solver = Callable[[Array], Array]


def _gain(
    manifold: Manifold, process: Process, dynamics: Dynamics, filtered: State, smoothed_next: State
) -> tuple[State, Array, _Solver, Array]:
    """Prediction, how far the next belief is from it, X -> P^-1 X of it, and F P."""
    predicted = predict(manifold, process, dynamics, filtered)
    dq = manifold.difference(predicted.q, smoothed_next.q)
    error = jnp.concatenate([dq, smoothed_next.v - predicted.v, smoothed_next.a - predicted.a])
    FP = transition(manifold, process, dynamics, filtered, filtered.covariance)
    return predicted, error, _solver(predicted.covariance), FP


def _solver(P: Float[Array, "n n"]) -> _Solver:
    """X -> P^-1 X, by a Cholesky factor of the correlations.

    Position and acceleration variances differ by many powers of the step; the correlations are
    far better conditioned than the covariance.
    """
    scale = 1.0 / jnp.sqrt(jnp.diagonal(P))[:, None]
    L = jnp.linalg.cholesky(P * scale * scale.T, symmetrize_input=False)

    def solve(X: Array) -> Array:
        half = jax.lax.linalg.triangular_solve(L, X * scale, left_side=True, lower=True)
        full = jax.lax.linalg.triangular_solve(
            L, half, left_side=True, lower=True, transpose_a=True
        )
        return full * scale

    return solve
