"""The traced part of a whole-sequence iteration: one chunk of frames to its normal equations.

Every chunk has the same shape, so one compilation serves sequences of any length, and memory
beyond the band matrix itself does not grow with it.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.estimate.sequence import (
    contact_terms,
    geometry_terms,
    gravity_terms,
    inertial_residuals,
    inertial_terms,
    pose_prior_terms,
    pose_terms,
    range_terms,
)
from mocap_jax.estimate.sequence.composite import joint_block, joint_border, joint_gradient
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.geometry_terms import GeometryInformation
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.window import Window, kinematics, sensor_dofs
from mocap_jax.stored_programs import StoredProgram


class ChunkSystem(NamedTuple):
    """Normal equations J'J x = -J'r of one chunk of c frames."""

    lower: Float[Array, "c b+1 nv nv"]
    """[k, o]: block (k + o, k)."""
    gradient: Float[Array, "c nv"]
    border: Float[Array, "c s 6 n"]
    """Compact border of the inertial residuals: see `chunk_border`."""
    screws: Float[Array, "c 6 nv"]
    range_border: Float[Array, "c s 3 nv"]
    """What ranges add: rows the receivers' offsets."""
    corner: Float[Array, "s n n"]
    corner_gradient: Float[Array, "s n"]
    geometry: GeometryInformation
    cost: Float[Array, ""]

    @property
    def border_parts(self) -> tuple[Array, Array, Array, Array]:
        """What `chunk_border` takes."""
        return self.border, self.screws, self.range_border, self.geometry.border


def _core(layout: Layout, q: Array) -> slice:
    return slice(layout.halo, q.shape[0] - layout.halo)


def _cost(
    layout: Layout, body: Body, w: Window, q: Array, constants: Constants, terms: Terms,
    weights: Weights,
) -> tuple[dict[str, Array], tuple]:  # fmt: skip
    """Squared whitened residuals of the core by kind, and the residuals themselves."""
    core = _core(layout, q)
    inertial = inertial_residuals.residuals(layout, w, constants, terms, weights, body.gravity)
    kinds = inertial_residuals.losses(layout, inertial, terms, weights, core)
    if layout.use_gravity:
        tilt = gravity_terms.residuals(layout, w, constants, terms, body.gravity)
        kinds["gravity"] = gravity_terms.losses(layout, tilt, terms, weights, core)
    ranges = None
    if layout.use_range:
        ranges = range_terms.residuals(w, terms)
        kinds["range"] = range_terms.losses(layout, ranges, terms, weights, core)
    pose = pose_terms.residuals(layout, body, q, terms, weights)
    kinds |= pose_terms.losses(layout, pose, terms, core)
    if layout.pose_joints:
        usual = pose_prior_terms.residual(w, weights)
        kinds["pose_prior"] = pose_prior_terms.losses(usual, terms, weights, core)
    if layout.contact_bodies:
        kinds["contact"] = contact_terms.losses(layout, w, terms, weights, core)
    for user, data, mask in zip(layout.user, terms.user_data, terms.user_mask, strict=True):
        values = pose_terms.user_values(layout, body, user, q, data, mask)
        kinds[user.name] = (values[core] ** 2).sum(-1)
    return kinds, (inertial, ranges, pose)


class ChunkValues(NamedTuple):
    """What residuals alone tell of the c core frames of a chunk."""

    cost: Float[Array, ""]
    """Half the sum of robust squared whitened residuals."""
    residuals: dict[str, Array]
    """Plain (not whitened) measurement residuals by kind, (c, s, 3) and (c, k)."""
    gate: Float[Array, "c k"] | None
    """The gate w_a of every range."""


@partial(StoredProgram, static=("layout",))
def evaluate_chunk(
    layout: Layout, body: Body, q: Array, constants: Constants, terms: Terms, weights: Weights
) -> ChunkValues:
    """Cost, residuals and gate of the core frames: one program for all that ask for any."""
    core = _core(layout, q)
    w = kinematics(layout, body, q, constants)
    kinds, (r, ranges, _) = _cost(layout, body, w, q, constants, terms, weights)
    shifted = slice(core.start - 1, core.stop - 1)
    out = {
        "accelerometer": r.acceleration[shifted],
        "gyroscope": r.rate[core],
        "orientation": r.orientation[core],
    }
    gate = None
    if layout.use_range:
        out["range"] = ranges.residual[shifted]
        gate = range_terms.gate(w, terms)[core]
    return ChunkValues(0.5 * sum(x.sum() for x in kinds.values()), out, gate)


@partial(StoredProgram, static=("layout",))
def assemble_chunk(
    layout: Layout, body: Body, q: Array, constants: Constants, terms: Terms, weights: Weights
) -> ChunkSystem:
    """Normal equations of the core frames of one chunk."""
    core = _core(layout, q)
    w = kinematics(layout, body, q, constants)
    kinds, (inertial, ranges, pose) = _cost(layout, body, w, q, constants, terms, weights)
    info = inertial_terms.information(layout, w, constants, terms, weights, inertial, core)
    if layout.use_gravity:
        info = gravity_terms.add(layout, info, w, constants, terms, weights, body.gravity, core)
    mask = sensor_dofs(layout)
    blocks = [
        joint_block(layout.topology, mask, block, _later(w, core, o), w.screws[core])
        for o, block in enumerate(info.blocks)
    ]
    blocks += [jnp.zeros_like(blocks[0])] * (layout.half_bandwidth + 1 - len(blocks))
    gradient = joint_gradient(mask, info.gradient, w.screws[core])
    if ranges is not None:
        rows = range_terms.rows(layout, w, ranges, terms, weights, core)
        (square, coupling), slope = range_terms.normal_blocks(rows)
        blocks[0], blocks[1] = blocks[0] + square, blocks[1] + coupling
        gradient = gradient + slope
    blocks, gradient = pose_terms.add_normal_blocks(
        layout, body, blocks, gradient, pose, terms, weights, core
    )
    if layout.pose_joints:
        usual = pose_prior_terms.residual(w, weights)
        blocks, gradient = pose_prior_terms.add_normal_blocks(
            layout, body, w, blocks, gradient, usual, terms, weights, core
        )
    if layout.contact_bodies:
        feet = contact_terms.rows(layout, w, terms, weights, core)
        (square, coupling), slope = contact_terms.normal_blocks(feet)
        blocks[0], blocks[1] = blocks[0] + square, blocks[1] + coupling
        gradient = gradient + slope
    blocks, gradient = pose_terms.add_user_blocks(layout, body, blocks, gradient, q, terms, core)
    range_border = jnp.zeros((0,), gradient.dtype)
    corner, corner_gradient = info.constants, info.constants_gradient
    geometry = geometry_terms.nothing(layout, len(gradient), gradient.dtype)
    if layout.use_border:
        sensors = len(layout.sites)
        range_border = jnp.zeros((len(gradient), sensors, 3, layout.topology.nv), gradient.dtype)
        if layout.lengths and info.accelerations is not None:
            geometry = geometry_terms.of_accelerations(layout, w, info.accelerations, core)
        if layout.lengths and layout.contact_bodies:
            geometry = geometry.plus(contact_terms.of_lengths(layout, feet, len(gradient)))
        if ranges is not None:
            told = range_terms.border(layout, rows)
            range_border, geometry = told.offset, geometry.plus(told.geometry)
            cells = layout.sensor_cells["offset"]
            corner = corner.at[:, cells, cells].add(told.offset_square)
            corner_gradient = corner_gradient.at[:, cells].add(told.offset_gradient)
    cost = 0.5 * sum(x.sum() for x in kinds.values())
    return ChunkSystem(
        jnp.stack(blocks, axis=1), gradient, info.border, w.screws[core], range_border,
        corner, corner_gradient, geometry, cost,
    )  # fmt: skip


def _later(w: Window, core: slice, offset: int) -> Array:
    return w.screws[core.start + offset : core.stop + offset]


@partial(StoredProgram, static=("layout",))
def chunk_border(
    layout: Layout, border: Array, screws: Array, range_border: Array, geometry: Array
) -> Float[Array, "c m nv"]:
    """Blocks of B' of a chunk, from its compact border."""
    blocks = joint_border(sensor_dofs(layout), border, screws)
    cells = layout.sensor_cells["offset"]
    around = (cells.start, layout.per_sensor - cells.stop)
    blocks = blocks + jnp.pad(range_border, ((0, 0), (0, 0), around, (0, 0)))
    blocks = blocks.reshape(blocks.shape[0], -1, layout.topology.nv)
    return jnp.concatenate([blocks, geometry], axis=1)
