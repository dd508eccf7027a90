"""Inertial samples of an interval, integrated once: rotation, velocity and position increments.

Between two knots a strapdown integration of many samples is one residual (Lupton and Sukkarieh
2012; Forster et al. 2017). Samples are means over their interval, so that a sample's rate times its
step is the integral itself; what the mean cannot tell, the change of the axis within a step
(coning) and of the force against it (sculling), comes from the sample before (Savage 1998).
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.residuals.inertial import log_below_pi


class Increment(NamedTuple):
    """What the samples of an interval add up to, in the sensor frame at its start."""

    rotation: Float[Array, "*b 3 3"]
    """R_start_end."""
    velocity: Float[Array, "*b 3"]
    """Integrated specific force [m/s]."""
    position: Float[Array, "*b 3"]
    """Integrated twice [m]."""


class Knot(NamedTuple):
    """State of the sensor at a knot."""

    rotation: Float[Array, "*b 3 3"]
    """R_world_sensor."""
    velocity: Float[Array, "*b 3"]
    """World frame [m/s]."""
    position: Float[Array, "*b 3"]
    """World frame [m]."""


class Samples(NamedTuple):
    """Samples of an interval; the row before the first is for coning and sculling only."""

    rate: Float[Array, "*b n+1 3"]
    """[rad/s], sensor frame."""
    force: Float[Array, "*b n+1 3"]
    """Specific force [m/s^2], sensor frame."""
    step: Float[Array, "*b n"]
    """Duration of each sample [s]; 0 for padding."""


CONSTANTS = {"gyroscope_scale": (3, 3), "accelerometer_bias": (3,), "accelerometer_scale": (3,)}
"""Constants of an inertial sensor and their shapes, in this order in a vector of 15."""


def corrected(
    samples: Samples, bias: Float[Array, "3"], constants: Float[Array, "15"]
) -> tuple[Array, Array]:
    """Rates and forces without the sensor's errors.

    Args:
        samples: as measured.
        bias: of the gyroscope [rad/s].
        constants: errors in the order of `CONSTANTS`: of the gyroscope, relative scale and
            cross-axis errors; of the accelerometer, bias [m/s^2] and relative scale.
    """
    scale = constants[:9].reshape(3, 3)
    rate = samples.rate - bias - samples.rate @ scale.T
    return rate, samples.force * (1 - constants[12:15]) - constants[9:12]


def preintegrate(
    samples: Samples, bias: Float[Array, "3"], constants: Float[Array, "15"]
) -> tuple[Increment, Float[Array, "n 3 3"]]:
    """The increment of one interval, and R_start_sample at the end of every sample."""
    rate, force = corrected(samples, bias, constants)
    step = samples.step[:, None]
    angle, push = step * rate[1:], step * force[1:]
    before, push_before = step * rate[:-1], step * force[:-1]
    turn = so3.exp(angle + so3.cross(before, angle) / 12)
    sculling = (so3.cross(before, push) + so3.cross(push_before, angle)) / 12
    gain = push + so3.cross(angle, push) / 2 + sculling

    def add(total: Increment, row: tuple[Array, Array, Array]) -> tuple[Increment, Array]:
        turn, gain, h = row
        gained = so3.matvec3(total.rotation, gain)
        rotation = so3.matmul3(total.rotation, turn)
        position = total.position + h * (total.velocity + gained / 2)
        return Increment(rotation, total.velocity + gained, position), rotation

    zero = jnp.zeros(3, step.dtype)
    start = Increment(jnp.eye(3, dtype=step.dtype), zero, zero)
    return jax.lax.scan(add, start, (turn, gain, samples.step))


def moved(increment: Increment, by: Float[Array, "9"]) -> Increment:
    """An increment perturbed by a rotation at its end, and by velocity and position."""
    rotation = so3.matmul3(increment.rotation, so3.exp(by[:3]))
    return Increment(rotation, increment.velocity + by[3:6], increment.position + by[6:])


def increment_slopes(
    samples: Samples, bias: Float[Array, "3"], constants: Float[Array, "15"]
) -> tuple[Increment, Float[Array, "9 18"]]:
    """The increment, and its derivative (as `moved` moves it) by bias and constants."""
    increment, _ = preintegrate(samples, bias, constants)

    def difference(x: Array) -> Array:
        other, _ = preintegrate(samples, x[:3], x[3:])
        turned = log_below_pi(so3.matmul3(increment.rotation.T, other.rotation))
        return jnp.concatenate([turned, other.velocity, other.position])

    return increment, jax.jacfwd(difference)(jnp.concatenate([bias, constants]))


def retract(knot: Knot, by: Float[Array, "9"]) -> Knot:
    """A knot moved by a world-frame rotation vector [rad], velocity and position."""
    rotation = so3.matmul3(so3.exp(by[:3]), knot.rotation)
    return Knot(rotation, knot.velocity + by[3:6], knot.position + by[6:])


retract_all = jax.jit(jax.vmap(retract))
"""`retract` for all knots of a recording."""


def interval_residual(
    first: Knot, second: Knot, increment: Increment, gravity: Float[Array, "3"],
    duration: Float[Array, ""],
) -> Float[Array, "9"]:  # fmt: skip
    """Motion from knot to knot less what was integrated: [rad], [m/s], [m], unwhitened.

    Rotation in the sensor frame at the end, the others in that at the start.
    """
    back = first.rotation.T
    turned = so3.matmul3(increment.rotation.T, so3.matmul3(back, second.rotation))
    gained = second.velocity - first.velocity - duration * gravity
    went = second.position - first.position - duration * first.velocity
    went = went - duration**2 / 2 * gravity
    return jnp.concatenate([
        log_below_pi(turned),
        so3.matvec3(back, gained) - increment.velocity,
        so3.matvec3(back, went) - increment.position,
    ])  # fmt: skip


def residual_slopes(
    first: Knot, second: Knot, increment: Increment, gravity: Float[Array, "3"],
    duration: Float[Array, ""],
) -> tuple[Float[Array, "9"], Float[Array, "9 27"]]:  # fmt: skip
    """`interval_residual` and its derivative by both knots (as `retract`) and the increment."""

    def shifted(x: Array) -> Array:
        moved_knots = retract(first, x[:9]), retract(second, x[9:18])
        return interval_residual(*moved_knots, moved(increment, x[18:]), gravity, duration)

    zero = jnp.zeros(27, increment.velocity.dtype)
    return shifted(zero), jax.jacfwd(shifted)(zero)
