"""Gradient of the quadratic model, J'W(r + J x), straight from the residuals of a chunk.

The assembled normal equations round J'WJ; this product keeps the accuracy of J, as iterative
refinement needs. JAX pushes the step forward through the residuals and pulls the result back; the
weights of robust losses are those of the linearisation point, as in the normal equations.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, retract
from mocap_jax.estimate.sequence import (
    contact_terms,
    gravity_terms,
    inertial_residuals,
    pose_prior_terms,
    pose_terms,
    range_terms,
)
from mocap_jax.estimate.sequence.constants import Constants, Corrections, Geometry
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.window import Window, kinematics
from mocap_jax.residuals.robust import loss, weight
from mocap_jax.stored_programs import StoredProgram


class Part(NamedTuple):
    """Residuals of one kind in the core frames."""

    residual: Float[Array, "*b n"]
    """Vectors whose squared norm a loss sees."""
    information: Float[Array, "*b n"]
    """Inverse variances (all of a vector equal where a loss is robust)."""
    loss: str = "none"
    scale: Float[Array, ""] | float = 1.0
    mu: Float[Array, ""] | float = 1.0

    @property
    def cost(self) -> Array:
        """Half the sum of the losses."""
        squared = (self.information * self.residual**2).sum(axis=-1)
        return 0.5 * loss(self.loss, squared, self.scale, self.mu).sum()

    @property
    def root(self) -> Array:
        """Root of information times the robust weight."""
        squared = (self.information * self.residual**2).sum(axis=-1, keepdims=True)
        return jnp.sqrt(self.information * weight(self.loss, squared, self.scale, self.mu))


def parts(
    layout: Layout, body: Body, q: Array, constants: Constants, terms: Terms, weights: Weights
) -> list[Part]:
    """All residuals of a chunk with halo whose centre lies in the core."""
    core = slice(layout.halo, q.shape[0] - layout.halo)
    before = slice(core.start - 1, core.stop - 1)
    w = kinematics(layout, body, q, constants)
    out = _inertial(layout, body, w, constants, terms, weights, core)
    if layout.use_gravity:
        tilt = gravity_terms.residuals(layout, w, constants, terms, body.gravity)[core]
        info = jnp.broadcast_to(terms.gravity[1][core][..., None], tilt.shape)
        out.append(Part(tilt, info, layout.gravity_loss, weights.gravity_scale))
    if layout.use_range:
        ranges = range_terms.residuals(w, _apart(layout, terms)).residual[before][..., None]
        info = terms.range_information[core][..., None]
        out.append(Part(ranges, info, layout.range_loss, weights.range_scale, weights.range_mu))
    pose = pose_terms.residuals(layout, body, q, terms, weights)
    limits = pose.limits[core]
    out += [
        Part(pose.reference[:, core], terms.reference_information[:, core]),
        Part(limits, jnp.broadcast_to(terms.limit_information[core][:, None], limits.shape)),
        Part(pose.smoothness[before], terms.smoothness_information[core]),
    ]
    if layout.pose_joints:
        x = pose_prior_terms.residual(w, weights)
        away, change = (
            pose_prior_terms.whitened(x[core], weights),
            pose_prior_terms.changes(x, weights)[core],
        )
        for residual, info in ((away, terms.pose_information), (change, terms.pace_information)):
            out.append(Part(residual, jnp.broadcast_to(info[core][:, None], residual.shape)))
    if layout.contact_bodies:
        out += [Part(*x) for x in contact_terms.kinds(layout, w, terms, weights, core)]
    for user, data, mask in zip(layout.user, terms.user_data, terms.user_mask, strict=True):
        values = pose_terms.user_values(layout, body, user, q, data, mask)[core]
        out.append(Part(values, jnp.ones_like(values)))
    return out


def _inertial(
    layout: Layout, body: Body, w: Window, constants: Constants, terms: Terms, weights: Weights,
    core: slice,
) -> list[Part]:  # fmt: skip
    r = inertial_residuals.residuals(layout, w, constants, terms, weights, body.gravity)
    before = slice(core.start - 1, core.stop - 1)
    kinds = (
        (layout.use_acceleration, r.acceleration[before], terms.force_information),
        (layout.use_rate, r.rate[core], terms.rate_information),
        (layout.use_orientation, r.orientation[core], terms.orientation_information),
    )
    return [
        Part(
            residual, jnp.broadcast_to(info[core][..., None], residual.shape),
            layout.inertial_loss, weights.inertial_scale,
        )
        for used, residual, info in kinds
        if used
    ]  # fmt: skip


def _apart(layout: Layout, terms: Terms) -> Terms:
    """Absent ranges between two different sites: pulling back through a zero distance gives NaN."""
    other = (terms.range_source + 1) % max(len(layout.range_sites), 1)
    receiver = jnp.where(terms.range_information > 0, terms.range_receiver, other)
    return dataclasses.replace(terms, range_receiver=receiver)


def moved_constants(layout: Layout, c: Constants, step: Float[Array, "m"]) -> Constants:
    """Constants after a tangent step, in the order of `constant_values`."""
    split = layout.per_sensor * len(layout.sites)
    d = step[:split].reshape(-1, layout.per_sensor)
    ends = np.cumsum(layout.geometry_sizes)
    length, source, sound, offset = jnp.split(step[split:], ends[:-1])
    g = c.geometry
    return Constants(
        gyroscope_bias=c.gyroscope_bias + d[:, :3],
        accelerometer_bias=c.accelerometer_bias + d[:, 3:6],
        mounting=so3.matmul3(c.mounting, so3.exp(d[:, 6:9])),
        offset=c.offset + d[:, 9:12],
        geometry=Geometry(
            g.length + length,
            g.source + source.reshape(-1, 3),
            g.sound + sound,
            g.range_offset + offset,
        ),
        corrections=_moved_corrections(layout, c.corrections, d),
    )


def _moved_corrections(layout: Layout, c: Corrections, d: Float[Array, "s n"]) -> Corrections:
    """Corrections after steps of all constants of each sensor."""
    moved = {
        f.name: getattr(c, f.name) + d[:, at]
        for f in dataclasses.fields(c)
        if (at := layout.sensor_cells[f.name]).stop > at.start
    }
    return dataclasses.replace(c, **moved)


@partial(StoredProgram, static=("layout",))
def chunk_model_gradient(
    layout: Layout,
    body: Body,
    q: Float[Array, "n nq"],
    constants: Constants,
    terms: Terms,
    weights: Weights,
    step: Float[Array, "n nv"],
    constants_step: Float[Array, "m"],
    offset: Float[Array, ""],
) -> tuple[Float[Array, "n nv"], Float[Array, "m"]]:
    """J'W(o r + J x) of the residuals of one chunk, by the frames of its window and the constants.

    Args:
        layout: shape of the problem.
        body: the body.
        q: poses of the chunk with its halo, where the problem is linearised.
        constants: likewise.
        terms: of the same frames.
        weights: scalars.
        step: x, by frame.
        constants_step: x of the constants.
        offset: o, 1 for the gradient of the model and 0 for the product with J'WJ.
    """
    base = parts(layout, body, q, constants, terms, weights)
    roots = [p.root for p in base]

    def whitened(x: Array, z: Array) -> list[Array]:
        poses = jax.vmap(lambda a, b: retract(layout.topology, a, b))(q, x)
        moved = parts(layout, body, poses, moved_constants(layout, constants, z), terms, weights)
        return [root * p.residual for root, p in zip(roots, moved, strict=True)]

    zero = (jnp.zeros_like(step), jnp.zeros_like(constants_step))
    residual, pull = jax.vjp(whitened, *zero)
    _, change = jax.jvp(whitened, zero, (step, constants_step))
    return pull([offset * r + c for r, c in zip(residual, change, strict=True)])


def model_gradient(
    layout: Layout,
    chunks: Iterable[tuple[Body, Array, Constants, Terms]],
    weights: Weights,
    x: Float[np.ndarray, "t nv"],
    z: Float[np.ndarray, "m"],
    *,
    offset: bool = True,
) -> tuple[Float[np.ndarray, "t nv"], Float[np.ndarray, "m"]]:
    """J'W(r + J (x, z)) of a whole sequence, without the priors on the constants.

    Without `offset`, J'WJ (x, z).

    Args:
        layout: shape of the problem.
        chunks: what `chunk_model_gradient` takes, chunk by chunk in order.
        weights: scalars.
        x: step of the frames.
        z: step of the constants; empty without a border.
        offset: include r.
    """
    (t, nv), halo, size = x.shape, layout.halo, layout.chunk
    count = -(-t // size)
    padded = np.zeros((count * size + 2 * halo, nv))
    padded[halo : halo + t] = x
    unused = np.zeros(layout.all_constants)
    out, step_z = np.zeros_like(padded), z if layout.use_border else unused
    out_z = np.zeros_like(step_z)
    for i, arguments in enumerate(chunks):
        rows = slice(i * size, i * size + size + 2 * halo)
        gradient, gradient_z = chunk_model_gradient(
            layout, *arguments, weights, padded[rows], step_z, float(offset)
        )
        out[rows] += np.asarray(gradient)
        out_z += np.asarray(gradient_z)
    return out[halo : halo + t], out_z if layout.use_border else z
