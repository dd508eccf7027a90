"""Beliefs of a filter cut off at the ranges of hinges and slides."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from mocap_jax.body import Body
from mocap_jax.body.topology import HINGE, SLIDE
from mocap_jax.estimate.pose_manifold import pose_manifold
from mocap_jax.kalman import State, apply, truncate


def within_ranges(body: Body, state: State) -> State:
    """The belief given that every hinge and slide is within its range, one bound at a time.

    Joints of other types, which have no range, and joints without one stay as they are.
    """
    topology = body.topology
    joints = [j for j, kind in enumerate(topology.joint_types) if kind in (HINGE, SLIDE)]
    if not joints:
        return state
    manifold = pose_manifold(topology)
    dofs = np.array([topology.joint_dof[j] for j in joints])
    places = np.array([topology.joint_qpos[j] for j in joints])
    ranges = jnp.asarray(body.joint_range, state.q.dtype)[np.array(joints)]

    def cut(state: State, joint: tuple[Array, Array, Array]) -> tuple[State, None]:
        dof, place, (low, high) = joint
        delta, P = truncate(state.covariance, dof, state.q[place] - low)
        state = apply(manifold, state, delta, P)
        delta, P = truncate(state.covariance, dof, high - state.q[place])
        return apply(manifold, state, -delta, P), None

    return jax.lax.scan(cut, state, (jnp.asarray(dofs), jnp.asarray(places), ranges))[0]
