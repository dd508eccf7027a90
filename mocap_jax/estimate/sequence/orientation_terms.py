"""Measured orientations: what boards would measure, and what the residuals say.

A board turned by a wrong heading about the vertical z and stamped late by d measures
Rz R_k exp(-d w_k), with the predicted rate w_k = log(R_k-1' R_k+1) / 2h. With E = exp(-d w_k) and
J the right Jacobian's inverse at the residual, its derivatives are J (R_k E)' by the world rotation
of frame k, -+ J Jr(-d w_k) d dw by those of its neighbours, J (R_k E)' z by the heading, -J w_k by
d, and J by the mounting.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.inertial_residuals import robust_information
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.orientation_prediction import spin
from mocap_jax.estimate.sequence.site_information import (
    SiteInformation,
    angular_block,
    angular_rows,
    columns,
    corner,
    matmul,
    transpose,
    with_one_frame,
)
from mocap_jax.estimate.sequence.window import Window


def add_orientations(
    layout: Layout,
    total: SiteInformation,
    w: Window,
    constants: Constants,
    terms: Terms,
    weights: Weights,
    residual: Float[Array, "n s 3"],
    core: slice,
) -> SiteInformation:
    """Add the information of measured orientations."""
    add = _add_late if layout.use_clock_offset else _add_prompt
    return add(layout, total, w, constants, terms, weights, residual, core)


def _add_prompt(
    layout: Layout,
    total: SiteInformation,
    w: Window,
    constants: Constants,
    terms: Terms,
    weights: Weights,
    residual: Array,
    core: slice,
) -> SiteInformation:
    """Where clocks are certain: each residual sees one frame."""
    residual = residual[core]
    info = robust_information(
        layout, residual, terms.orientation_information[core], weights.inertial_scale
    )
    inverse = so3.right_jacobian_inverse(residual)
    turn = so3.matmul3(inverse, transpose(w.rotation[core]))
    heading = {"heading": turn[..., 2:]} if layout.use_heading else {}
    cols = columns(layout, inverse, **heading)
    return with_one_frame(layout, total, turn, cols, info, residual)


class _Rows(NamedTuple):
    """Jacobians of all frames of a chunk (of its first and last frame: unused)."""

    turn: tuple[Float[Array, "n s 3 3"], ...]
    """By the world rotation of the frame before, the frame, and the frame after."""
    columns: Float[Array, "n s 3 m"]


def _late_rows(
    layout: Layout, w: Window, constants: Constants, residual: Array, step: Array
) -> _Rows:
    late = jnp.asarray(constants.corrections.clock_offset)
    rate = spin(w.rotation, step)
    inverse = so3.right_jacobian_inverse(residual)
    there = transpose(so3.matmul3(w.rotation, so3.exp(-late * rate)))
    here = so3.matmul3(inverse, there)
    after = jnp.concatenate([w.rotation[1:], w.rotation[-1:]])
    faster = so3.matmul3(so3.right_jacobian_inverse(2 * step * rate), transpose(after)) / (2 * step)
    moved = so3.matmul3(so3.matmul3(inverse, so3.right_jacobian(-late * rate)), faster)
    beside = -late[..., None] * moved
    others = {"clock_offset": -so3.matvec3(inverse, rate)[..., None]}
    if layout.use_heading:
        others["heading"] = here[..., 2:]
    return _Rows((-beside, here, beside), columns(layout, inverse, **others))


def _add_late(
    layout: Layout,
    total: SiteInformation,
    w: Window,
    constants: Constants,
    terms: Terms,
    weights: Weights,
    residual: Array,
    core: slice,
) -> SiteInformation:
    """Where clocks are unknown: each residual sees its neighbours, for the rate."""
    rows = _late_rows(layout, w, constants, residual, weights.step)
    info = robust_information(
        layout, residual, terms.orientation_information, weights.inertial_scale
    )
    size = core.stop - core.start

    def centred(x: Array, place: int) -> Array:
        """Rows of x (by centre) that have the core frames at place -1, 0, 1."""
        return x[core.start - place : core.start - place + size]

    weighted = [info[..., None, None] * turn for turn in rows.turn]
    blocks = list(total.blocks)
    for later in range(3):
        for earlier in range(later + 1):
            left, right = (centred(x, earlier - 1) for x in (rows.turn[later], weighted[earlier]))
            square = angular_block(matmul(transpose(left), right))
            blocks[later - earlier] = blocks[later - earlier] + square
    gradient, border = total.gradient, total.border
    for j, turn in enumerate(weighted):
        by = transpose(centred(turn, j - 1))
        pull = so3.matvec3(by, centred(residual, j - 1))
        gradient = gradient + angular_rows(pull[..., None])[..., 0]
        border = border + angular_rows(matmul(by, centred(rows.columns, j - 1)))
    found = corner(layout, total, rows.columns, info, residual, core.start, size)
    return SiteInformation(tuple(blocks), gradient, border, *found, total.accelerations)
