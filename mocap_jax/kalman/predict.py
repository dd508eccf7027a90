"""Time update: a pose with velocity and acceleration, driven by noise (Vlasic 2007, eq. 1, 5, 6).

With u the step taken in the tangent space, an error of the pose before the step shows after it as
`Exp(-u) dq`, an error of the step as `Jr(u) du`; both are the identity for coordinates that add.
"""

from __future__ import annotations

from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.kalman.manifold import Manifold
from mocap_jax.kalman.state import State

Process = Literal["white_jerk", "paper", "euler"]
"""`white_jerk`: acceleration is a random walk in continuous time, integrated exactly.
`paper`: noise enters the acceleration once a frame, the step is integrated exactly.
`euler`: the form printed in the paper, each quantity stepped by the next one alone."""


class Dynamics(NamedTuple):
    """How the state moves from frame to frame, in numbers."""

    step: Float[Array, ""]
    """Time step h [s]."""
    noise: Float[Array, "3 3 nv"]
    """Diagonals of the nine blocks of Q (`process_noise`)."""
    pull: Float[Array, "nv"] | None = None
    """Corner rate w of a Butterworth process per degree of freedom [rad/s]: the mean jerk is
    -2 w a - 2 w^2 v - w^3 (q - centre), which gives every quantity a finite variance. 0 leaves
    it free."""
    centre: Float[Array, "nq"] | None = None
    """Pose that the pull leads to."""


def butterworth_rate(density: Array, sigma: Array) -> Array:
    """Corner rate [rad/s] at which a process of this jerk density has the given deviation.

    The third-order Butterworth process has the variance density / (3 w^5).
    """
    return (density / (3 * sigma**2)) ** 0.2


@partial(jax.jit, static_argnums=0)
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
    manifold: Manifold,
    process: Process,
    dynamics: Dynamics,
    state: State,
    X: Float[Array, "3*nv k"],
) -> Float[Array, "3*nv k"]:
    """`F @ X`, with F the derivative of the dynamics at the state, applied block by block."""
    nv, h = state.v.shape[0], dynamics.step
    u, curvature = _step(process, state, h)
    dq, dv, da = X[:nv], X[nv : 2 * nv], X[2 * nv :]
    moved = manifold.shift(u, dq) + manifold.jacobian(u, h * dv + curvature * da)
    da_new = da
    if dynamics.pull is not None:
        w = dynamics.pull[:, None]
        away = manifold.jacobian_inverse(_away(manifold, dynamics, state), dq)
        da_new = da - h * (2 * w * da + 2 * w**2 * dv + w**3 * away)
    return jnp.concatenate([moved, dv + h * da, da_new])


def _away(manifold: Manifold, dynamics: Dynamics, state: State) -> Array:
    """From the centre to the pose, where there is a pull."""
    away = manifold.difference(dynamics.centre, state.q)
    return jnp.where(jnp.asarray(dynamics.pull) > 0, away, 0.0)


def advance(manifold: Manifold, process: Process, dynamics: Dynamics, state: State) -> State:
    """Mean one step later; the covariance stays as it is."""
    h, a = dynamics.step, state.a
    u, _ = _step(process, state, h)
    if dynamics.pull is not None:
        w = dynamics.pull
        away = _away(manifold, dynamics, state)
        a = a - h * (2 * w * a + 2 * w**2 * state.v + w**3 * away)
    return State(manifold.retract(state.q, u), state.v + h * state.a, a, state.covariance)


def with_noise(dynamics: Dynamics, P: Float[Array, "3*nv 3*nv"]) -> Float[Array, "3*nv 3*nv"]:
    """Covariance with that of a step's noise added, made symmetric."""
    nv = dynamics.noise.shape[-1]
    here = jnp.arange(nv)
    blocks = P.reshape(3, nv, 3, nv)
    blocks = blocks.at[:, here, :, here].add(jnp.moveaxis(dynamics.noise, -1, 0))
    P = blocks.reshape(3 * nv, 3 * nv)
    return 0.5 * (P + P.T)


def predict(manifold: Manifold, process: Process, dynamics: Dynamics, state: State) -> State:
    """Advance the belief by one step."""
    half = transition(manifold, process, dynamics, state, state.covariance)
    P = transition(manifold, process, dynamics, state, half.T)
    moved = advance(manifold, process, dynamics, state)
    return moved._replace(covariance=with_noise(dynamics, P))
