"""The corner of the normal equations: what is known about the constants alone."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.assemble import ChunkSystem
from mocap_jax.estimate.sequence.constants import Constants


def constant_values(c: Constants) -> Float[np.ndarray, "m"]:
    """All constants in their order: gyroscope bias, accelerometer bias, mounting rotation vector,
    offset and `Corrections` of each sensor; segment lengths, source positions, speed of sound,
    range offsets."""
    g = c.geometry
    parts = (_of_sensors(c), g.length, g.source, g.sound, g.range_offset)
    return np.concatenate([np.ravel(np.asarray(x)) for x in parts])


def _of_sensors(c: Constants) -> Float[np.ndarray, "s n"]:
    """The constants of each sensor in their order."""
    turn = np.asarray(so3.log(jnp.asarray(c.mounting)))
    more = (getattr(c.corrections, f.name) for f in dataclasses.fields(c.corrections))
    parts = (c.gyroscope_bias, c.accelerometer_bias, turn, c.offset, *more)
    return np.concatenate([np.asarray(x) for x in parts if np.size(x)] or [turn], axis=1)


def prior_equations(
    constants: Constants,
    prior: Float[np.ndarray, "m"],
    readings: tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]],
    mixing: Float[np.ndarray, "m m"] | None = None,
) -> tuple[float, np.ndarray, np.ndarray]:
    """Cost, gradient (m,) and curvature (m, m) of priors on and readings of the constants.

    Args:
        constants: where.
        prior: inverse variances about zero.
        readings: direct measurements and their inverse variances.
        mixing: what they are measurements of, a row of factors of all constants each; default of
            each constant.
    """
    values, (read, sure) = constant_values(constants), readings
    jacobian, width = np.eye(len(values)), _of_sensors(constants).shape[1]
    turns = np.asarray(so3.right_jacobian_inverse(so3.log(jnp.asarray(constants.mounting))))
    for i, turn in enumerate(turns):
        cells = slice(width * i + 6, width * i + 9)
        jacobian[cells, cells] = turn
    if mixing is None:
        cost = 0.5 * float((prior * values**2 + sure * (values - read) ** 2).sum())
        gradient = jacobian.T @ (prior * values + sure * (values - read))
        return cost, gradient, jacobian.T @ ((prior + sure)[:, None] * jacobian)
    off, seen = mixing @ values - read, mixing @ jacobian
    cost = 0.5 * float((prior * values**2 + sure * off**2).sum())
    square = jacobian.T @ (prior[:, None] * jacobian) + seen.T @ (sure[:, None] * seen)
    return cost, jacobian.T @ (prior * values) + seen.T @ (sure * off), square


def add_chunk(out: ChunkSystem, corner: np.ndarray, slope: np.ndarray) -> None:
    """Add what a chunk tells about the constants alone."""
    own, between = np.asarray(out.corner, float), np.asarray(out.geometry.cross, float)
    sensors, n, _ = own.shape
    split = sensors * n
    for i in range(sensors):
        cells = slice(n * i, n * i + n)
        corner[cells, cells] += own[i]
    between = between.reshape(split, -1)
    corner[:split, split:] += between
    corner[split:, :split] += between.T
    corner[split:, split:] += np.asarray(out.geometry.square, float)
    slope[:split] += np.ravel(np.asarray(out.corner_gradient, float))
    slope[split:] += np.asarray(out.geometry.gradient, float)
