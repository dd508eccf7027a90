"""One frame of the filter: the time update and the sequence of measurement updates."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array

from mocap_jax.body import Body
from mocap_jax.estimate.filter_model import FilterModel, FrameInput, Parameters
from mocap_jax.estimate.filter_terms import DERIVATIVES, TERMS
from mocap_jax.estimate.joint_ranges import within_ranges
from mocap_jax.estimate.pose_manifold import pose_manifold
from mocap_jax.kalman import (
    Innovation,
    State,
    predict,
    predict_unscented,
    update,
    update_unscented,
)
from mocap_jax.measurement.chain import Chain, chain


def filter_frame(
    body: Body, model: FilterModel, parameters: Parameters, state: State, frame: FrameInput
) -> tuple[State, dict[str, Innovation]]:
    """Advance the belief to a frame and take in its measurements, one kind after the other.

    The kinds run through one loop, so that the body's kinematics, linearised anew for each, are
    compiled once.
    """
    manifold = pose_manifold(body.topology)
    if model.sigma_points is None:
        moved = predict(manifold, model.process, parameters.dynamics, state)
    else:
        moved = predict_unscented(
            manifold, model.process, parameters.dynamics, state, model.sigma_points
        )
    current = _choose(frame.first, state, moved)
    branches = [_taking_in(kind, body, model, parameters, frame) for kind in model.kinds]

    def take_in(i: Array, carry: _Carry) -> _Carry:
        c = chain(body, carry[0].q, carry[0].v, carry[0].a)
        return jax.lax.switch(i, branches, c, *carry)

    if not branches:
        return _choose(frame.valid, current, state), {}
    carry = (current, _no_innovations(branches, body, current))
    current, innovations = jax.lax.fori_loop(0, len(branches), take_in, carry)
    if model.limits:
        current = within_ranges(body, current)
    return _choose(frame.valid, current, state), innovations


_Carry = tuple[State, dict[str, Innovation]]
_Branch = Callable[[Chain, State, dict[str, Innovation]], _Carry]


def _taking_in(
    kind: str, body: Body, model: FilterModel, parameters: Parameters, frame: FrameInput
) -> _Branch:
    """The update by one kind of measurement."""
    gate = model.range_gate if kind == "D" else 0.0
    manifold, terms_of = pose_manifold(body.topology), TERMS[kind]

    def residual(state: State) -> Array:
        c = chain(body, state.q, state.v, state.a)
        return terms_of(body, model, parameters, c, state, frame)[1]

    def branch(c: Chain, state: State, innovations: dict[str, Innovation]) -> _Carry:
        terms = terms_of(body, model, parameters, c, state, frame)
        if model.sigma_points is None:
            state, innovation = update(manifold, state, *terms, gate=gate)
        else:
            state, innovation = update_unscented(
                manifold, state, residual, *terms[2:], points=model.sigma_points, gate=gate,
                columns=DERIVATIVES[kind] * body.nv,
            )  # fmt: skip
        return state, innovations | {kind: innovation}

    return branch


def _no_innovations(branches: list[_Branch], body: Body, state: State) -> dict[str, Innovation]:
    """Zeros in the shapes of what the updates return."""
    out: dict[str, Innovation] = {}
    for branch in branches:
        shapes = jax.eval_shape(
            lambda s, branch=branch: branch(chain(body, s.q, s.v, s.a), s, {})[1], state
        )
        out |= jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    return out


def _choose(condition: Array, yes: State, no: State) -> State:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)
