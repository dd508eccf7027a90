"""The compiled loops of the filter: a fixed number of frames at a time, forwards and backwards.

One compilation serves recordings of any length: the last chunk is padded with frames that are not
valid. The backward pass recomputes each chunk's forward beliefs from the one at its start, so that
full covariances of only one chunk are held at a time.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.estimate.filter_frame import (
    FilterModel,
    FrameInput,
    Parameters,
    filter_frame,
)
from mocap_jax.estimate.pose_manifold import pose_manifold
from mocap_jax.kalman import Innovation, State, smooth_step


class Estimates(NamedTuple):
    """Estimates of t frames."""

    q: Float[Array, "t nq"]
    v: Float[Array, "t nv"]
    covariance: Float[Array, "t nv nv"] | None
    """Marginal of each pose."""


def _estimate(state: State, covariance: bool) -> Estimates:
    nv = state.v.shape[0]
    return Estimates(state.q, state.v, state.covariance[:nv, :nv] if covariance else None)


@partial(jax.jit, static_argnames=("model", "covariance"))
def filter_chunk(
    body: Body,
    model: FilterModel,
    parameters: Parameters,
    state: State,
    frames: FrameInput,
    covariance: bool,
) -> tuple[State, Estimates, dict[str, Innovation]]:
    """Filter a chunk: the belief after it, the estimates, and what each update saw."""

    def step(state: State, frame: FrameInput) -> tuple[State, tuple]:
        state, innovations = filter_frame(body, model, parameters, state, frame)
        return state, (_estimate(state, covariance), innovations)

    state, (estimates, innovations) = jax.lax.scan(step, state, frames)
    return state, estimates, innovations


@partial(jax.jit, static_argnames=("model", "covariance"))
def smooth_chunk(
    body: Body,
    model: FilterModel,
    parameters: Parameters,
    start: State,
    frames: FrameInput,
    next_state: State,
    next_valid: Array,
    covariance: bool,
) -> tuple[State, Estimates]:
    """Smooth a chunk.

    Args:
        body, model, parameters: of the filter.
        start: filtered belief before the chunk's first frame.
        frames: the chunk's measurements.
        next_state: smoothed belief at the first frame after the chunk.
        next_valid: whether there is such a frame.
        covariance: return the marginals.

    Returns:
        The smoothed belief at the chunk's first frame, and the estimates.
    """
    manifold = pose_manifold(body.topology)

    def forward(state: State, frame: FrameInput) -> tuple[State, State]:
        state, _ = filter_frame(body, model, parameters, state, frame)
        return state, state

    _, filtered = jax.lax.scan(forward, start, frames)

    def backward(carry: State, inputs: tuple[State, Array]) -> tuple[State, Estimates]:
        here, follows = inputs
        smoothed = smooth_step(manifold, model.process, parameters.dynamics, here, carry)
        keep = follows & jnp.isfinite(smoothed.covariance).all()
        smoothed = jax.tree.map(lambda a, b: jnp.where(keep, a, b), smoothed, here)
        return smoothed, _estimate(smoothed, covariance)

    follows = jnp.concatenate([frames.valid[1:], next_valid[None]])
    return jax.lax.scan(backward, next_state, (filtered, follows), reverse=True)
