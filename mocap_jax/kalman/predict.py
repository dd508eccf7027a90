"""Time update: a pose with velocity and acceleration, driven by noise (Vlasic 2007, eq. 1, 5, 6).

With u the step taken in the tangent space, an error of the pose before the step shows after it as
`Exp(-u) dq`, an error of the step as `Jr(u) du`; both are the identity for coordinates that add.
"""

from __future__ import annotations

from typing import Literal

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.kalman.manifold import Manifold
from mocap_jax.kalman.state import State

Process = Literal["white_jerk", "paper", "euler"]
"""`white_jerk`: acceleration is a random walk in continuous time, integrated exactly.
`paper`: noise enters the acceleration once a frame, the step is integrated exactly.
`euler`: the form printed in the paper, each quantity stepped by the next one alone."""


def process_noise(
    process: Process, step: Float[Array, ""], density: Float[Array, "nv"]
) -> Float[Array, "3 3 nv"]:
    """Diagonals of the nine blocks of Q.

    Args:
        process: the dynamics.
        step: time step h [s].
        density: spectral density of the jerk per degree of freedom [rad^2/s^5 or m^2/s^5]. Noise
            that enters once a frame has the variance `density * step`.
    """
    h, o = step, jnp.zeros_like(step)
    if process == "white_jerk":
        rows = [
            [h**5 / 20, h**4 / 8, h**3 / 6],
            [h**4 / 8, h**3 / 3, h**2 / 2],
            [h**3 / 6, h**2 / 2, h],
        ]
    else:
        rows = [[o, o, o], [o, o, o], [o, o, h]]
    return jnp.stack([jnp.stack(row) for row in rows])[:, :, None] * density


def _step(process: Process, state: State, h: Array) -> tuple[Array, Array]:
    """Tangent step of the pose, and its derivative by the acceleration."""
    curvature = h * 0 if process == "euler" else h**2 / 2
    return state.v * h + state.a * curvature, curvature


def transition(
    manifold: Manifold, process: Process, state: State, h: Array, X: Float[Array, "3*nv k"]
) -> Float[Array, "3*nv k"]:
    """`F @ X`, with F the derivative of the dynamics at the state, applied block by block."""
    nv = state.v.shape[0]
    u, curvature = _step(process, state, h)
    dq, dv, da = X[:nv], X[nv : 2 * nv], X[2 * nv :]
    moved = manifold.shift(u, dq) + manifold.jacobian(u, h * dv + curvature * da)
    return jnp.concatenate([moved, dv + h * da, da])


def predict(
    manifold: Manifold, process: Process, state: State, h: Array, noise: Float[Array, "3 3 nv"]
) -> State:
    """Advance the belief by one step.

    Args:
        manifold: of the poses.
        process: the dynamics.
        state: the belief before the step.
        h: time step [s].
        noise: diagonals of the blocks of Q (`process_noise`).
    """
    nv = state.v.shape[0]
    u, _ = _step(process, state, h)
    half = transition(manifold, process, state, h, state.covariance)
    P = transition(manifold, process, state, h, half.T).reshape(3, nv, 3, nv)
    here = jnp.arange(nv)
    P = P.at[:, here, :, here].add(jnp.moveaxis(noise, -1, 0)).reshape(3 * nv, 3 * nv)
    return State(
        manifold.retract(state.q, u), state.v + h * state.a, state.a, 0.5 * (P + P.T)
    )
