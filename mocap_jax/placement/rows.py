"""Whitened Jacobian rows of boards at a known motion, and the equations they add up to.

The residuals are the estimator's (`residuals.inertial`): second difference of position against
specific force, and turn over an interval against angular rate. Their Jacobians are written out
here by the world twist of the board's segment, so that they are a smooth function of where the
board sits: nothing has to be traced through the tree of joints again. Tests hold the sums against
the estimator's own normal equations.

A board's orientation on its segment does not appear: noise and priors are the same in all
directions, so turning a board turns its readings, biases and mounting angles but adds and takes
away no information.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float, Int

from mocap_jax import so3
from mocap_jax.body import Topology
from mocap_jax.compilation_cache import COMPILER_OPTIONS
from mocap_jax.placement.kinematics import Kinematics
from mocap_jax.placement.options import ErrorModel
from mocap_jax.placement.prior import on_grid
from mocap_jax.residuals.inertial import CONSISTENT, log_below_pi

# How long one model error lasts [s]: a board rings on tissue at 8 to 20 Hz.
_LASTING = 0.02

CONSTANTS = 12
"""Of a board: gyroscope bias, accelerometer bias, mounting rotation, offset."""


class Boards(NamedTuple):
    """Where n boards are."""

    body: Int[Array, "n"]
    """Index of the segment that carries each."""
    position: Float[Array, "n 3"]
    """In the segment's frame [m]."""
    weight: Float[Array, "n"]
    """Share of each that is used; 1, or between 0 and 1 in a relaxed selection."""


class Rows(NamedTuple):
    """Whitened Jacobians; `force[j]` is by frame c - 1 + j, `rate[j]` by frame c + j."""

    force: Float[Array, "3 t-2 n 3 nv"]
    force_constants: Float[Array, "t-2 n 3 12"]
    rate: Float[Array, "2 t-1 n 3 nv"]
    rate_constants: Float[Array, "t-1 n 3 12"]


class System(NamedTuple):
    """What boards add to the normal equations."""

    lower: Float[Array, "t 3 nv nv"]
    border: Float[Array, "t m nv"]
    corner: Float[Array, "n 12 12"]


def variances_of(
    k: Kinematics, boards: Boards, errors: ErrorModel
) -> tuple[Float[Array, "t n"], Float[Array, "t n"]]:
    """Variances of specific forces and of rates on the study's grid.

    Model errors outlast a sample: a grid step averages over few of them only.
    """
    grid, model = on_grid(errors, k.step), errors.model
    share = float(model.model_errors) * _LASTING / k.step
    one = jnp.concatenate([jnp.ones((len(boards.position), 1)), boards.position], axis=1)
    jerk = jnp.einsum("ni,tnij,nj->tn", one, k.jerk[:, boards.body], one)
    turn, spin = k.turn[:, boards.body], k.spin[:, boards.body]
    force = model.accelerometer_model**2 + model.lever_arm_sigma**2 * (turn + spin)
    force = grid.accelerometer**2 + share * (force + model.lag**2 * jerk)
    rate = grid.gyroscope**2 + share * (model.gyroscope_model**2 + model.lag**2 * turn)
    return force, rate


def rows_of(topology: Topology, k: Kinematics, boards: Boards, errors: ErrorModel) -> Rows:
    """Rows of all boards, weights included."""
    force_variance, rate_variance = variances_of(k, boards, errors)
    R = k.rotation[:, boards.body]
    arm = so3.matvec3(R, boards.position)
    mask = jnp.asarray(topology.body_dofs, R.dtype)[boards.body][None, :, None, :]
    turn = mask * jnp.swapaxes(k.angular, 1, 2)[:, None]
    point = k.position[:, boards.body] + arm
    linear = mask * jnp.swapaxes(k.linear, 1, 2)[:, None]
    move = linear - so3.matmul3(so3.skew(point), turn)
    force = _force_rows(k, boards, R, move, turn)
    rate = _rate_rows(k, boards, R, turn)
    # Masks stay outside of the roots: the slope of a root is infinite at zero.
    used = jnp.sqrt(boards.weight)
    centre = ("A" in errors.kinds) * k.present[:-2] * k.present[1:-1] * k.present[2:]
    between = ("G" in errors.kinds) * k.present[:-1] * k.present[1:]
    root_force = used * centre[:, None] / jnp.sqrt(force_variance[1:-1])
    root_rate = used * between[:, None] / jnp.sqrt(rate_variance[:-1])
    scale = lambda root, x: root[..., None, None] * x  # noqa: E731
    return Rows(*(scale(root_force, x) for x in force), *(scale(root_rate, x) for x in rate))


def _force_rows(
    k: Kinematics, boards: Boards, R: Array, move: Array, turn: Array
) -> tuple[Array, Array]:
    """Derivatives of acceleration residuals centred at frames 1 .. t - 2."""
    h = k.step
    one = jnp.concatenate([jnp.ones((len(boards.position), 1)), boards.position], axis=1)
    force = jnp.einsum("tnij,nj->tni", k.force[:, boards.body], one)
    world = so3.matvec3(R, force)
    alpha = jnp.array([1.0, -2.0, 1.0]) / h**2
    cut = lambda x, j: x[j : len(x) - 2 + j]  # noqa: E731
    measured = [CONSISTENT[j] * cut(world, j) for j in range(3)]
    poses = jnp.stack(
        [
            alpha[j] * cut(move, j) + so3.matmul3(so3.skew(measured[j]), cut(turn, j))
            for j in range(3)
        ]
    )
    bias = sum(CONSISTENT[j] * cut(R, j) for j in range(3))
    mounting = sum(so3.matmul3(so3.skew(measured[j]), cut(R, j)) for j in range(3))
    offset = sum(alpha[j] * cut(R, j) for j in range(3))
    return poses, jnp.concatenate([jnp.zeros_like(bias), bias, mounting, offset], axis=-1)


def _rate_rows(k: Kinematics, boards: Boards, R: Array, turn: Array) -> tuple[Array, Array]:
    """Derivatives of rate residuals of the intervals 0 .. t - 2."""
    h, rate = k.step, k.rate[:, boards.body]
    turned = log_below_pi(so3.matmul3(jnp.swapaxes(R[:-1], -1, -2), R[1:]))
    to_rate = so3.matmul3(so3.right_jacobian_inverse(turned), jnp.swapaxes(R[1:], -1, -2)) / h
    poses = jnp.stack([-so3.matmul3(to_rate, turn[:-1]), so3.matmul3(to_rate, turn[1:])])
    bias = jnp.eye(3) - h / 12 * so3.skew(rate[1:] - rate[:-1])
    mounting = so3.matmul3(to_rate, R[1:] - R[:-1])
    zero = jnp.zeros_like(mounting)
    return poses, jnp.concatenate([bias, zero, mounting, zero], axis=-1)


@partial(jax.jit, static_argnums=(0, 3), compiler_options=COMPILER_OPTIONS)
def system_of(topology: Topology, k: Kinematics, boards: Boards, errors: ErrorModel) -> System:
    """Sum up the rows of all boards."""
    rows = rows_of(topology, k, boards, errors)
    t, n = k.rotation.shape[0], len(boards.position)
    flat = lambda x: x.reshape(*x.shape[:-3], n * 3, x.shape[-1])  # noqa: E731
    force, rate = flat(rows.force), flat(rows.rate)
    gram = lambda a, b: jnp.einsum("crm,crn->cmn", a, b)  # noqa: E731
    put = lambda x, first: jnp.pad(  # noqa: E731
        x, [(first, t - first - len(x))] + [(0, 0)] * (x.ndim - 1)
    )
    lower = []
    for o in range(3):
        block = sum(put(gram(force[j + o], force[j]), j) for j in range(3 - o))
        if o < 2:
            block = block + sum(put(gram(rate[j + o], rate[j]), j) for j in range(2 - o))
        lower.append(block)
    couple = lambda c, x: jnp.einsum("cnip,cniv->cnpv", c, x)  # noqa: E731
    border = sum(put(couple(rows.force_constants, rows.force[j]), j) for j in range(3))
    border = border + sum(put(couple(rows.rate_constants, rows.rate[j]), j) for j in range(2))
    corner = sum(
        jnp.einsum("cnip,cniq->npq", c, c) for c in (rows.force_constants, rows.rate_constants)
    )
    return System(jnp.stack(lower, 1), border.reshape(t, n * CONSTANTS, -1), corner)


def respond(
    rows: Rows, x: Float[Array, "t nv p"], z: Float[Array, "n 12 p"]
) -> tuple[Float[Array, "t-2 n 3 p"], Float[Array, "t-1 n 3 p"]]:
    """Whitened change of the readings with p directions of poses and constants."""
    t = len(x)
    force = sum(
        jnp.einsum("cniv,cvp->cnip", rows.force[j], x[j : t - 2 + j]) for j in range(3)
    ) + jnp.einsum("cnik,nkp->cnip", rows.force_constants, z)
    rate = sum(
        jnp.einsum("cniv,cvp->cnip", rows.rate[j], x[j : t - 1 + j]) for j in range(2)
    ) + jnp.einsum("cnik,nkp->cnip", rows.rate_constants, z)
    return force, rate


def _energies(
    topology: Topology, k: Kinematics, boards: Boards, errors: ErrorModel, x: Array, z: Array
) -> Float[Array, "n"]:
    force, rate = respond(rows_of(topology, k, boards, errors), x, z)
    return (force**2).sum((0, 2, 3)) + (rate**2).sum((0, 2, 3))


@partial(jax.jit, static_argnums=(0, 3), compiler_options=COMPILER_OPTIONS)
def energies(
    topology: Topology, k: Kinematics, boards: Boards, errors: ErrorModel, x: Array, z: Array
) -> Float[Array, "n"]:
    """x'H x of each board's information H, summed over directions, whatever its weight."""
    whole = boards._replace(weight=jnp.ones_like(boards.weight))
    return _energies(topology, k, whole, errors, x, z)


@partial(jax.jit, static_argnums=(0, 3), compiler_options=COMPILER_OPTIONS)
def energy_slopes(
    topology: Topology, k: Kinematics, boards: Boards, errors: ErrorModel, x: Array, z: Array
) -> Float[Array, "n 3"]:
    """Derivative of the weighted sum of energies by the boards' positions, directions fixed."""
    return jax.grad(
        lambda p: _energies(topology, k, boards._replace(position=p), errors, x, z).sum()
    )(boards.position)
