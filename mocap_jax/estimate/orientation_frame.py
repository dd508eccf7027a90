"""One frame of the orientation pass: the pose whose sensors are turned as measured.

    E(q) = sum over sensors of w_s |log(R_measured^T R_predicted(q))|^2 + sum |extra(q)|^2,

with the pose prior among the extra residuals, is minimised over the coordinates that follow no
others, within their ranges, by Levenberg-Marquardt with an active set: coordinates at a limit that
the gradient presses against it are held there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from mocap_jax import so3
from mocap_jax.body import (
    Body,
    Frames,
    Piecewise,
    Topology,
    couplings,
    frames,
    retract,
    site_jacobians,
)
from mocap_jax.body import sites_on_frames as on_frames
from mocap_jax.body.topology import HINGE, SLIDE
from mocap_jax.estimate.orientation_prior import FramePrior

ExtraResidual = Callable[[Body, Array], Array]
"""`f(body, q) -> (m,)`, whitened: a prior on poses, a limit penalty, ..."""

# Damping, relative to the diagonal: smallest, at first, largest (no step helps any more).
_SMALLEST, _START, _LARGEST = 1e-9, 1e-6, 1e8
# Relative to the largest curvature: holds what nothing determines where it was.
_FLOOR = 1e-9


@dataclass(frozen=True)
class Follower:
    """A coordinate that follows another: places in v and q of both, and the function."""

    dof: int
    coordinate: int
    leader_dof: int
    leader_coordinate: int
    function: Piecewise


@dataclass(frozen=True)
class FrameProblem:
    """What is the same for all frames and decides the shape of the program; hashable."""

    topology: Topology
    sites: tuple[int, ...]
    free: tuple[int, ...]
    """Degrees of freedom that follow no others."""
    followers: tuple[Follower, ...]
    extras: tuple[ExtraResidual, ...]
    prior: FramePrior | None = None


class Rules(NamedTuple):
    """Where coordinates may be, and when to stop."""

    place: Int[Array, "n"]
    """Place in q of each free degree of freedom; -1 for those that are no plain coordinate."""
    low: Float[Array, "n"]
    high: Float[Array, "n"]
    """Limits [rad, m]; infinite where there are none."""
    iterations: Int[Array, ""]
    """Most steps."""
    tolerance: Float[Array, ""]
    """Converged when no coordinate moves by more [rad, m]."""


class FrameFit(NamedTuple):
    """Result for one frame."""

    q: Float[Array, "nq"]
    error: Float[Array, "s 3"]
    """Rotation vectors from measured to predicted sensors, in the measured frame [rad]; zero for
    those of no weight."""
    cost: Float[Array, ""]
    """E."""
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]


class _State(NamedTuple):
    q: Array
    residual: Array
    jacobian: Array
    damping: Array
    count: Array
    converged: Array
    stuck: Array


def frame_problem(
    body: Body, sites: tuple[int, ...], extras: tuple[ExtraResidual, ...],
    prior: FramePrior | None = None,
) -> FrameProblem:  # fmt: skip
    """Describe the problem of a body whose sensors sit on the given sites."""
    topology = body.topology
    followers = []
    in_v, in_q = topology.joint_dof.tolist(), topology.joint_qpos.tolist()
    for c in couplings(body):
        j, leader = topology.joint_index(c.joint), topology.joint_index(c.leader)
        followers.append(Follower(in_v[j], in_q[j], in_v[leader], in_q[leader], c.function))
    following = {f.dof for f in followers}
    free = tuple(i for i in range(topology.nv) if i not in following)
    return FrameProblem(topology, sites, free, tuple(followers), extras, prior)


def rules_of(
    body: Body, problem: FrameProblem, *, limits: bool, iterations: int, tolerance: float
) -> Rules:
    """Rules for a body; its ranges count only with `limits`."""
    topology = body.topology
    in_q, in_v = topology.scalar_index
    place = dict(zip(in_v.tolist(), in_q.tolist(), strict=True))
    low, high = np.full(topology.nv, -np.inf), np.full(topology.nv, np.inf)
    ranges = np.asarray(body.joint_range)
    for j, kind in enumerate(topology.joint_types):
        if limits and kind in (HINGE, SLIDE):
            low[topology.joint_dof[j]], high[topology.joint_dof[j]] = ranges[j]
    free = np.array(problem.free, int)
    return Rules(
        np.array([place.get(i, -1) for i in problem.free]), low[free], high[free],
        np.asarray(iterations), np.asarray(tolerance),
    )  # fmt: skip


def solve_frame(
    problem: FrameProblem, rules: Rules, body: Body,
    weight: Float[Array, "s"], start: Float[Array, "nq"], R_world_sensor: Float[Array, "s 3 3"],
) -> FrameFit:  # fmt: skip
    """Fit one frame.

    Args:
        problem: see `FrameProblem`.
        rules: of `rules_of`.
        body: its sites carry the sensors.
        weight: of the squared error of each sensor [1/rad^2]; zero where it measured nothing.
        start: pose to start from.
        R_world_sensor: measured orientations; anything finite where the weight is zero.
    """
    place, low, high = rules.place, rules.low, rules.high
    bounded = place >= 0

    def evaluate(q: Array) -> tuple[Array, Array]:
        return _linearised(problem, body, weight, q, R_world_sensor)

    def coordinates(q: Array) -> Array:
        return jnp.where(bounded, q[jnp.maximum(place, 0)], 0.0)

    def step(state: _State) -> _State:
        x = coordinates(state.q)
        gradient = state.jacobian.T @ state.residual
        held = bounded & (((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
        delta = _damped_step(state, gradient, held)
        delta = jnp.where(bounded, jnp.clip(x + delta, low, high) - x, delta)
        q = follow_leaders(problem, _retract_free(problem, state.q, delta))
        residual, jacobian = evaluate(q)
        better = residual @ residual <= state.residual @ state.residual
        small = jnp.abs(delta).max() < rules.tolerance
        damping = jnp.clip(state.damping * jnp.where(better, 0.1, 10.0), _SMALLEST, _LARGEST)
        keep = lambda new, old: jnp.where(better, new, old)  # noqa: E731
        return _State(
            keep(q, state.q), keep(residual, state.residual), keep(jacobian, state.jacobian),
            damping, state.count + 1, small, ~small & (damping >= _LARGEST),
        )  # fmt: skip

    inside = jnp.where(bounded, jnp.clip(coordinates(start), low, high), 0.0)
    # Places of no plain coordinate point past the end, and nothing is written there.
    q = start.at[jnp.where(bounded, place, start.size)].set(inside, mode="drop")
    q = follow_leaders(problem, q)
    damping = jnp.asarray(_START, q.dtype)
    no = jnp.asarray(False)
    first = _State(q, *evaluate(q), damping, jnp.asarray(0), no, no)
    going = lambda s: ~(s.converged | s.stuck) & (s.count < rules.iterations)  # noqa: E731
    last = jax.lax.while_loop(going, step, first)
    root = jnp.sqrt(weight)[:, None]
    error = last.residual[: 3 * weight.size].reshape(-1, 3) / jnp.where(root > 0, root, 1.0)
    return FrameFit(last.q, error, last.residual @ last.residual, last.count, last.converged)


def follow_leaders(problem: FrameProblem, q: Float[Array, "nq"]) -> Float[Array, "nq"]:
    """The pose with all following coordinates at their functions' values."""
    for f in problem.followers:
        q = q.at[f.coordinate].set(f.function.at(q[f.leader_coordinate]))
    return q


def _retract_free(problem: FrameProblem, q: Array, delta: Array) -> Array:
    full = jnp.zeros(problem.topology.nv, q.dtype).at[np.array(problem.free, int)].set(delta)
    return retract(problem.topology, q, full)


def _damped_step(state: _State, gradient: Array, held: Array) -> Array:
    """Levenberg-Marquardt step of the coordinates that are not held; zero of the others."""
    H = state.jacobian.T @ state.jacobian
    moves = (~held).astype(H.dtype)
    H = H * moves[:, None] * moves
    diagonal = jnp.diagonal(H)
    floor = _FLOOR * diagonal.max() + jnp.finfo(H.dtype).tiny
    H = H + jnp.diag(state.damping * diagonal + floor + (1.0 - moves) * diagonal.max())
    return -jax.scipy.linalg.solve(H, gradient * moves, assume_a="pos")


def _linearised(
    problem: FrameProblem, body: Body, weight: Array, q: Array, R_measured: Array
) -> tuple[Array, Array]:
    """Whitened residuals (m,) and their derivatives by the free degrees of freedom (m, n)."""
    f = frames(body, q)
    error, J = _errors(problem, body, f, R_measured)
    root = jnp.sqrt(weight)[:, None]
    residuals = [(root * error).ravel()]
    jacobians = [(root[..., None] * J).reshape(-1, problem.topology.nv)]
    if problem.prior is not None:
        usual, slopes = problem.prior.linearised(body, f)
        residuals.append(usual)
        jacobians.append(slopes)
    zero = jnp.zeros(problem.topology.nv, q.dtype)
    for extra in problem.extras:
        moved = lambda d, f=extra: f(body, retract(problem.topology, q, d))  # noqa: E731
        residuals.append(moved(zero))
        jacobians.append(jax.jacfwd(moved)(zero))
    full = jnp.concatenate(jacobians)
    for follower in reversed(problem.followers):
        slope = jax.grad(follower.function.at)(q[follower.leader_coordinate])
        full = full.at[:, follower.leader_dof].add(slope * full[:, follower.dof])
    return jnp.concatenate(residuals), full[:, np.array(problem.free, int)]


def _errors(
    problem: FrameProblem, body: Body, f: Frames, R_measured: Array
) -> tuple[Float[Array, "s 3"], Float[Array, "s 3 nv"]]:
    """Errors of the sensors and their derivatives by all degrees of freedom.

    Turning the sensor by the world vector u changes log(R_m^T R_p) by Jr^-1 R_p^T u.
    """
    sites = np.array(problem.sites, int)
    rotation, position = on_frames(body, f)
    R_predicted = rotation[sites]
    error = so3.log(so3.matmul3(jnp.swapaxes(R_measured, -1, -2), R_predicted))
    _, angular = site_jacobians(body, f, position, sites)
    chain = so3.matmul3(so3.right_jacobian_inverse(error), jnp.swapaxes(R_predicted, -1, -2))
    return error, jnp.einsum("sij,snj->sin", chain, angular)
