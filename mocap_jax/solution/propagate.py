"""The covariance of the pose carried over to angles, orientations, positions and velocities."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body, Topology, difference, retract
from mocap_jax.body.topology import HINGE
from mocap_jax.compilation_cache import COMPILER_OPTIONS
from mocap_jax.errors import InputError
from mocap_jax.solution.anatomy import JointAngle, anatomical_frames, joint_angle_list
from mocap_jax.solution.pose_jacobians import (
    PoseJacobians,
    cardan_jacobians,
    pose_jacobians,
    relative_rotation_jacobians,
)
from mocap_jax.solution.poses import map_frames
from mocap_jax.solution.solution import Solution

Pairs = tuple[tuple[int, int], ...]
"""(segment, base) by body index."""


def covariance_of(solution: Solution) -> Float[np.ndarray, "t nv nv"]:
    """The covariance of every pose.

    Raises:
        InputError: the solution has none.
    """
    if solution.covariance is None:
        raise InputError(
            f"the solution (method {solution.method}) has no covariance; estimate it with "
            "covariance=True in the options"
        )
    return np.asarray(solution.covariance, np.float64)


def segment_covariances(
    solution: Solution, rows: np.ndarray | slice = slice(None)
) -> PoseJacobians:
    """Covariances (t, nbody, 3, 3) [rad^2, m^2] in place of the derivatives of `PoseJacobians`."""
    q, P = np.asarray(solution.trajectory.q)[rows], covariance_of(solution)[rows]
    return map_frames(_segments, (_plain(solution.body),), q, P)


def joint_angle_std(
    solution: Solution, rows: np.ndarray | slice = slice(None)
) -> tuple[tuple[str, ...], Float[np.ndarray, "t n"]]:
    """Names and standard deviations [rad] of the angles of `joint_angles`, in their order.

    Args:
        solution: with covariance.
        rows: frames wanted; default all.
    """
    body, listed = solution.body, joint_angle_list(solution.body)
    q, P = np.asarray(solution.trajectory.q)[rows], covariance_of(solution)[rows]
    variance = map_frames(
        _angle_variances, (_angle_plan(body, listed), _plain(body), anatomical_frames(body)), q, P
    )
    return tuple(a.name for a in listed), _root(variance)


def cardan_std(
    solution: Solution, segment: str, base: str, rows: np.ndarray | slice = slice(None)
) -> Float[np.ndarray, "t 3"]:
    """Standard deviations [rad] of the Z-X-Y angles of a segment relative to another."""
    body = solution.body
    pair = (body.topology.body_index(segment), body.topology.body_index(base))
    q, P = np.asarray(solution.trajectory.q)[rows], covariance_of(solution)[rows]
    plan = AnglePlan((pair,), (0, 0, 0), (0, 1, 2))
    return _root(map_frames(_angle_variances, (plan, _plain(body), anatomical_frames(body)), q, P))


def relative_rotation_std(
    solution: Solution, segments: list[tuple[str, str]]
) -> Float[np.ndarray, "t n"]:
    """Root-mean-square angle [rad] that the covariance allows between segments (segment, base)."""
    body = solution.body
    pairs = tuple((body.topology.body_index(a), body.topology.body_index(b)) for a, b in segments)
    q = np.asarray(solution.trajectory.q)
    return _root(map_frames(_relative, (pairs, _plain(body)), q, covariance_of(solution)))


def joint_angle_rate_std(
    solution: Solution, angles: Float[np.ndarray, "t n"]
) -> Float[np.ndarray, "t-1 n"]:
    """Standard deviations [rad/s] of `diff(angles) / diff(time)`, from the pair covariances.

    Args:
        solution: with pair covariances.
        angles: as `joint_angles` gives them; they tell which Cardan solution each frame is in.
    """
    body, listed = solution.body, joint_angle_list(solution.body)
    plan = _angle_plan(body, listed)
    side = np.ones_like(angles)
    for column, angle in enumerate(listed):
        if angle.axis == 1:
            side[:, column] = np.where(np.cos(angles[:, column]) < 0, -1.0, 1.0)
    fixed = (plan, _plain(body), anatomical_frames(body))
    q, P, C, step = _neighbours(solution)
    variance = map_frames(_angle_steps, fixed, q[:-1], q[1:], P[:-1], P[1:], C, side[:-1], side[1:])
    return _root(variance) / step[:, None]


def velocity_std(solution: Solution) -> Float[np.ndarray, "t-1 nv"]:
    """Standard deviations [rad/s, m/s] of `difference(q_k, q_k+1) / step`, by degree of freedom."""
    q, P, C, step = _neighbours(solution)
    topology = solution.body.topology
    variance = map_frames(_steps, (topology,), q[:-1], q[1:], P[:-1], P[1:], C)
    return _root(variance) / step[:, None]


def _neighbours(solution: Solution) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Poses, their covariances, those of neighbours, and the time between frames."""
    if solution.pair_covariance is None:
        raise InputError(
            f"the solution (method {solution.method}) has no covariance of neighbouring poses; "
            "estimate it with pair_covariance=True in the options (optimiser or smoother)"
        )
    step = np.diff(np.asarray(solution.trajectory.time))
    q, C = np.asarray(solution.trajectory.q), np.asarray(solution.pair_covariance)
    return q, covariance_of(solution), C, step


class AnglePlan(NamedTuple):
    """Which angles to read (hashable: static under `jit`)."""

    pairs: Pairs
    """Pairs of segments whose Cardan angles are taken."""
    pair: tuple[int, ...]
    """Per angle: which pair, or -1 for a coordinate."""
    axis: tuple[int, ...]
    """Per angle: row of z, x, y, or the degree of freedom of the coordinate."""


def _angle_plan(body: Body, listed: tuple[JointAngle, ...]) -> AnglePlan:
    topology = body.topology
    segments = sorted({a.segment for a in listed if a.axis >= 0})
    pair, axis = [], []
    for angle in listed:
        if angle.axis >= 0:
            pair.append(segments.index(angle.segment))
            axis.append(angle.axis)
            continue
        joints = topology.joints_of_body(angle.segment)
        hinge = next(j for j in joints if topology.joint_types[j] == HINGE)
        pair.append(-1)
        axis.append(int(topology.joint_dof[hinge]))
    pairs = tuple((b, int(topology.body_parent[b])) for b in segments)
    return AnglePlan(pairs, tuple(pair), tuple(axis))


def _angle_jacobian(plan: AnglePlan, body: Body, anatomical: Array, q: Array) -> Array:
    """Derivatives of the planned angles at one pose, (n, nv)."""
    nv = body.topology.nv
    by_pair = cardan_jacobians(body, q, anatomical, plan.pairs).reshape(-1, nv)
    table = jnp.concatenate([by_pair, jnp.eye(nv, dtype=q.dtype)])
    pair, axis = np.array(plan.pair, int), np.array(plan.axis, int)
    return table[np.where(pair >= 0, 3 * pair + axis, len(by_pair) + axis)]


@partial(jax.jit, compiler_options=COMPILER_OPTIONS)
def _segments(body: Body, q: Array, P: Array) -> PoseJacobians:
    def one(pose: Array, covariance: Array) -> PoseJacobians:
        carried = lambda J: J @ covariance @ jnp.swapaxes(J, 1, 2)  # noqa: E731
        return PoseJacobians(*(carried(J) for J in pose_jacobians(body, pose)))

    return jax.vmap(one)(q, P)


@partial(jax.jit, static_argnums=0, compiler_options=COMPILER_OPTIONS)
def _angle_variances(plan: AnglePlan, body: Body, anatomical: Array, q: Array, P: Array) -> Array:
    J = jax.vmap(lambda pose: _angle_jacobian(plan, body, anatomical, pose))(q)
    return ((J @ P) * J).sum(-1)


@partial(jax.jit, static_argnums=0, compiler_options=COMPILER_OPTIONS)
def _relative(pairs: Pairs, body: Body, q: Array, P: Array) -> Array:
    J = jax.vmap(lambda pose: relative_rotation_jacobians(body, pose, pairs))(q)
    return ((J @ P[:, None]) * J).sum((-2, -1))


@partial(jax.jit, static_argnums=0, compiler_options=COMPILER_OPTIONS)
def _angle_steps(
    plan: AnglePlan, body: Body, anatomical: Array, q: Array, q_next: Array, P: Array,
    P_next: Array, C: Array, side: Array, side_next: Array,
) -> Array:  # fmt: skip
    """Variances of the change of angles from a frame to the next."""
    jacobian = jax.vmap(lambda pose: _angle_jacobian(plan, body, anatomical, pose))
    return _change_variance(
        side[..., None] * jacobian(q), side_next[..., None] * jacobian(q_next), P, P_next, C
    )


@partial(jax.jit, static_argnums=0, compiler_options=COMPILER_OPTIONS)
def _steps(topology: Topology, q: Array, q_next: Array, P: Array, P_next: Array, C: Array) -> Array:
    """Variances of the tangent vector from a frame to the next."""

    def jacobians(a: Array, b: Array) -> tuple[Array, Array]:
        zero = jnp.zeros(topology.nv, a.dtype)

        def between(x: Array, y: Array) -> Array:
            return difference(topology, retract(topology, a, x), retract(topology, b, y))

        return jax.jacfwd(between, argnums=(0, 1))(zero, zero)

    before, after = jax.vmap(jacobians)(q, q_next)
    return _change_variance(-before, after, P, P_next, C)


def _change_variance(J: Array, J_next: Array, P: Array, P_next: Array, C: Array) -> Array:
    """Variances of `J_next x_next - J x`, frame by frame."""
    quadratic = lambda A, M, B: ((A @ M) * B).sum(-1)  # noqa: E731
    return quadratic(J_next, P_next, J_next) + quadratic(J, P, J) - 2 * quadratic(J_next, C, J)


def _plain(body: Body) -> Body:
    """The text of the model is part of the compilation key and has no part in the kinematics."""
    return dataclasses.replace(body, xml="")


def _root(variance: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(variance, 0.0))
