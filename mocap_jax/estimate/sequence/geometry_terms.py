"""What accelerations say about segment lengths, the constants that many sensors share.

A longer segment l shifts everything beyond it by its world offset d_l. An acceleration residual of
a sensor beyond it changes by the second difference of d_l; in twist coordinates its Jacobian by
frame j is [alpha_j I, skew(y_j)] (see `inertial_terms`), so the coupling of length l to degree of
freedom i is a sum over the sensors beyond both, which factors into sums of weights and of weighted
y_j over sensors, and products with the screw of i and d_l afterwards.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.window import Window, lengths_beneath, sensor_dofs


class GeometryInformation(NamedTuple):
    """J'WJ and J'Wr of the constants that belong to no sensor (`Layout.geometry` of them)."""

    border: Float[Array, "c g nv"]
    cross: Float[Array, "s n g"]
    """With the sensors' own constants."""
    square: Float[Array, "g g"]
    gradient: Float[Array, "g"]

    def plus(self, other: GeometryInformation) -> GeometryInformation:
        """The sum of two."""
        return GeometryInformation(*(a + b for a, b in zip(self, other, strict=True)))


def nothing(layout: Layout, frames: int, dtype: jnp.dtype) -> GeometryInformation:
    """No information."""
    g, s = layout.geometry, len(layout.sites)
    return GeometryInformation(
        jnp.zeros((frames, g, layout.topology.nv), dtype),
        jnp.zeros((s, layout.per_sensor, g), dtype),
        jnp.zeros((g, g), dtype),
        jnp.zeros(g, dtype),
    )


class AccelerationRows(NamedTuple):
    """Acceleration residuals by centre frame (1 .. n - 2) and the parts of their Jacobians."""

    residual: Float[Array, "n-2 s 3"]
    information: Float[Array, "n-2 s"]
    alpha: Float[Array, "3"]
    y: list[Float[Array, "n-2 s 3"]]
    """By frame of the window."""
    columns: Float[Array, "n-2 s 3 m"]
    """By the sensor's constants."""


def of_accelerations(
    layout: Layout, w: Window, rows: AccelerationRows, core: slice
) -> GeometryInformation:
    """Information of the accelerations that touch the core frames."""
    size, lengths = core.stop - core.start, len(layout.lengths)
    beneath = lengths_beneath(layout, layout.sites)
    n = w.position.shape[0]
    change = sum(rows.alpha[j] * w.spans[j : n - 2 + j] for j in range(3))
    border = jnp.zeros((size, lengths, layout.topology.nv), change.dtype)
    for j in range(3):
        # Centres whose window has core frame k at place j; residual arrays start at centre 1.
        centres = slice(core.start - j, core.start - j + size)
        border = border + _coupling(layout, w, rows, change, beneath, j, centres, core)
    middle = slice(core.start - 1, core.stop - 1)
    info, a = rows.information[middle], change[middle]
    mask = jnp.asarray(beneath, info.dtype)
    shared = (info @ (mask[:, :, None] * mask[:, None, :]).reshape(len(mask), -1)).reshape(
        size, lengths, lengths
    )
    square = (shared * (a[:, :, None] * a[:, None]).sum(-1)).sum(0)
    weighted = info[..., None] * rows.residual[middle]
    gradient = jnp.einsum("nsp,nlp,sl->l", weighted, a, mask)
    columns = info[..., None, None] * rows.columns[middle]
    cross = jnp.einsum("nspq,nlp->sql", columns, a) * mask[:, None, :]
    rest = layout.geometry - lengths
    return GeometryInformation(
        jnp.pad(border, ((0, 0), (0, rest), (0, 0))),
        jnp.pad(cross, ((0, 0), (0, 0), (0, rest))),
        jnp.pad(square, ((0, rest), (0, rest))),
        jnp.pad(gradient, (0, rest)),
    )


def _coupling(
    layout: Layout,
    w: Window,
    rows: AccelerationRows,
    change: Array,
    beneath: np.ndarray,
    j: int,
    centres: slice,
    core: slice,
) -> Float[Array, "c l nv"]:
    """Border blocks of the core frames from residuals that have them at place j."""
    wt, y, a = rows.information[centres], rows.y[j][centres], change[centres]
    both = beneath[:, :, None] & sensor_dofs(layout)[:, None, :]
    shape = (-1, *both.shape[1:])
    select = jnp.asarray(both.reshape(len(both), -1), wt.dtype)
    weight = (wt @ select).reshape(shape)
    arms = [((wt * y[..., p]) @ select).reshape(shape) for p in range(3)]
    screws = w.screws[core]
    # Per length and degree of freedom: force alpha a, moment a x (sum of w y).
    moment = so3.cross(a[:, :, None, :], jnp.stack(arms, axis=-1))
    linear = sum(a[:, :, None, p] * screws[:, None, p] for p in range(3))
    angular = sum(moment[..., p] * screws[:, None, 3 + p] for p in range(3))
    return rows.alpha[j] * weight * linear + angular
