"""The compiled loops of the filter: a fixed number of frames at a time, forwards and backwards.

One compilation serves recordings of any length: the last chunk is padded with frames that are not
valid. The backward pass takes the forward beliefs that `filter_chunk` returns.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Bool, Float

from mocap_jax.body import Body, Topology
from mocap_jax.estimate.filter_frame import filter_frame
from mocap_jax.estimate.filter_model import FilterModel, FrameInput, Parameters
from mocap_jax.estimate.pose_manifold import pose_manifold
from mocap_jax.kalman import Dynamics, Innovation, Process, State, smooth_pair, smooth_step
from mocap_jax.stored_programs import StoredProgram


class Estimates(NamedTuple):
    """Estimates of t frames."""

    q: Float[Array, "t nq"]
    v: Float[Array, "t nv"]
    covariance: Float[Array, "t nv nv"] | None
    """Marginal of each pose."""
    pair: Float[Array, "t nv nv"] | None = None
    """Of the next pose with each; zero for the last of the recording."""


@partial(StoredProgram, static=("model",))
def filter_chunk(
    body: Body, model: FilterModel, parameters: Parameters, state: State, frames: FrameInput
) -> tuple[State, State, dict[str, Innovation]]:
    """Filter a chunk: the belief after it, those of all its frames, and what each update saw."""

    def step(state: State, frame: FrameInput) -> tuple[State, tuple]:
        state, innovations = filter_frame(body, model, parameters, state, frame)
        return state, (state, innovations)

    state, (beliefs, innovations) = jax.lax.scan(step, state, frames)
    return state, beliefs, innovations


@partial(StoredProgram, static=("topology", "process", "covariance", "pairs"))
def smooth_chunk(
    topology: Topology,
    process: Process,
    dynamics: Dynamics,
    beliefs: State,
    valid: Bool[Array, "t"],
    next_state: State,
    next_valid: Bool[Array, ""],
    covariance: bool,
    pairs: bool,
) -> tuple[State, Estimates]:
    """Smooth a chunk.

    Args:
        topology: of the body.
        process, dynamics: of the filter.
        beliefs: filtered beliefs of the chunk's frames.
        valid: which of them are frames of the recording.
        next_state: smoothed belief at the first frame after the chunk.
        next_valid: whether there is such a frame.
        covariance: return the marginals.
        pairs: return the covariances of neighbours too (only with `covariance`).

    Returns:
        The smoothed belief at the chunk's first frame, and the estimates.
    """
    manifold = pose_manifold(topology)
    nv = topology.nv

    def backward(carry: State, inputs: tuple[State, Array]) -> tuple[State, Estimates]:
        here, follows = inputs
        pair = None
        if pairs:
            smoothed, pair = smooth_pair(manifold, process, dynamics, here, carry)
        else:
            smoothed = smooth_step(manifold, process, dynamics, here, carry, covariance)
        finite = [jnp.isfinite(x).all() for x in smoothed]
        keep = follows & jnp.stack(finite).all()
        smoothed = jax.tree.map(lambda a, b: jnp.where(keep, a, b), smoothed, here)
        marginal = smoothed.covariance[:nv, :nv] if covariance else None
        pair = None if pair is None else jnp.where(keep, pair, 0.0)
        return smoothed, Estimates(smoothed.q, smoothed.v, marginal, pair)

    follows = jnp.concatenate([valid[1:], next_valid[None]])
    return jax.lax.scan(backward, next_state, (beliefs, follows), reverse=True)
