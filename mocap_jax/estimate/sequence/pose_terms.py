"""Residuals on the pose itself, chunk by chunk: references, limits, smoothness, the user's own."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body, difference, retract
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.residuals.joint_space import (
    increment_jacobians,
    limit_violation,
    reference_residual,
    smoothness_coefficients,
)
from mocap_jax.so3 import right_jacobian_inverse


class PoseResiduals(NamedTuple):
    """Residuals of a chunk of n frames, by frame."""

    reference: Float[Array, "2 n nv"]
    limits: Float[Array, "n nlimited"]
    limit_slopes: Float[Array, "n nlimited"]
    increments: Float[Array, "n-1 nv"]
    smoothness: Float[Array, "m nv"]
    """Row i: the difference over frames i .. i + order."""


def residuals(
    layout: Layout, body: Body, q: Array, terms: Terms, weights: Weights
) -> PoseResiduals:
    """All residuals on the poses of a chunk."""
    topology = layout.topology
    reference = jax.vmap(jax.vmap(lambda a, b: reference_residual(topology, a, b)))(
        jnp.broadcast_to(q, terms.reference.shape), terms.reference
    )
    increments = jax.vmap(lambda a, b: difference(topology, a, b))(q[:-1], q[1:])
    coefficients = smoothness_coefficients(layout.smoothness_order, weights.step)
    m = q.shape[0] - layout.smoothness_order
    smoothness = sum(c * increments[i : i + m] for i, c in enumerate(coefficients))
    scalar_q, lower, upper = limited_coordinates(body)
    limits, slopes = jax.jvp(
        lambda x: limit_violation(x, lower, upper, weights.limit_softness),
        (q[:, scalar_q],),
        (jnp.ones_like(q[:, scalar_q]),),
    )
    return PoseResiduals(reference, limits, slopes, increments, smoothness)


def limited_coordinates(body: Body) -> tuple[np.ndarray, Array, Array]:
    """Indices in q of all hinge and slide joints, and their limits."""
    kinds = np.array(body.topology.joint_types)
    chosen = np.flatnonzero((kinds == "hinge") | (kinds == "slide"))
    return (
        body.topology.joint_qpos[chosen],
        body.joint_range[chosen, 0],
        body.joint_range[chosen, 1],
    )


def losses(
    layout: Layout, r: PoseResiduals, terms: Terms, core: slice
) -> dict[str, Float[Array, "c"]]:
    """Squared whitened residuals by kind; smoothness counts at the second frame of its window."""
    rows = slice(core.start - 1, core.stop - 1)
    return {
        "reference": (terms.reference_information[:, core] * r.reference[:, core] ** 2).sum((0, 2)),
        "limits": terms.limit_information[core] * (r.limits[core] ** 2).sum(-1),
        "smoothness": (terms.smoothness_information[core] * r.smoothness[rows] ** 2).sum(-1),
    }


class _Banded(NamedTuple):
    """Separable contributions: per pair of frames, scalars on the diagonal and 3x3 blocks."""

    scalar: Float[Array, "c nscalar"]
    rotation: Float[Array, "c nquat 3 3"]


def add_normal_blocks(
    layout: Layout,
    body: Body,
    blocks: list[Array],
    gradient: Array,
    r: PoseResiduals,
    terms: Terms,
    weights: Weights,
    core: slice,
) -> tuple[list[Array], Array]:
    """Add references, limits and smoothness to the blocks and gradient of the core frames."""
    parts = [_zero_part(layout, core, gradient.dtype) for _ in blocks]
    parts[0], gradient = _add_references(layout, parts[0], gradient, r, terms, core)
    parts[0], gradient = _add_limits(layout, body, parts[0], gradient, r, terms, core)
    parts, gradient = _add_smoothness(layout, parts, gradient, r, terms, weights, core)
    return [_spread(layout, b, p) for b, p in zip(blocks, parts, strict=True)], gradient


def _zero_part(layout: Layout, core: slice, dtype: jnp.dtype) -> _Banded:
    size = core.stop - core.start
    scalars, quats = layout.topology.scalar_index[1], layout.topology.quat_index[1]
    return _Banded(
        jnp.zeros((size, len(scalars)), dtype), jnp.zeros((size, len(quats), 3, 3), dtype)
    )


def _spread(layout: Layout, block: Array, part: _Banded) -> Array:
    """Add a separable contribution to dense blocks.

    Every row has at most three entries, in known columns. Multiplying by constant masks fuses into
    one vectorised pass; a scatter walks its indices one by one and copies the blocks.
    """
    entries, columns = _places(layout)
    size = part.scalar.shape[0]
    flat = jnp.concatenate(
        [part.scalar, part.rotation.reshape(size, -1), jnp.zeros((size, 1), block.dtype)], axis=1
    )
    rows = flat[:, entries]
    inside = columns[:, :, None] == np.arange(block.shape[-1])
    masks = jnp.asarray(inside, block.dtype)
    return block + sum(rows[:, :, m, None] * masks[:, m] for m in range(3))


def _places(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Where the entries (nv, 3) of each row are in a flat part, and their columns (-1: none)."""
    (_, scalars), (_, quats) = layout.topology.scalar_index, layout.topology.quat_index
    nothing = len(scalars) + 9 * len(quats)
    entries = np.full((layout.topology.nv, 3), nothing)
    columns = np.full((layout.topology.nv, 3), -1)
    entries[scalars, 0], columns[scalars, 0] = np.arange(len(scalars)), scalars
    entries[quats] = len(scalars) + np.arange(9 * len(quats)).reshape(-1, 3, 3)
    columns[quats] = quats[:, None, :]
    return entries, columns


def _join(layout: Layout, scalar: Array, rotation: Array) -> Float[Array, "c nv"]:
    """Gradient from its scalar and rotation parts (a permutation)."""
    (_, scalars), (_, quats) = layout.topology.scalar_index, layout.topology.quat_index
    order = np.argsort(np.concatenate([scalars, quats.ravel()]))
    return jnp.concatenate([scalar, rotation.reshape(len(scalar), -1)], axis=1)[:, order]


def _add_references(
    layout: Layout, part: _Banded, gradient: Array, r: PoseResiduals, terms: Terms, core: slice
) -> tuple[_Banded, Array]:
    scalars, quats = layout.topology.scalar_index[1], layout.topology.quat_index[1]
    info, residual = terms.reference_information[:, core], r.reference[:, core]
    weighted = info * residual
    scalar = part.scalar + info[..., scalars].sum(0)
    inverse = right_jacobian_inverse(residual[..., quats])
    rotation = part.rotation + _congruence(inverse, info[..., quats], inverse).sum(0)
    pull = (inverse * weighted[..., quats][..., :, None]).sum(-2)
    gradient = gradient + _join(layout, weighted[..., scalars].sum(0), pull.sum(0))
    return _Banded(scalar, rotation), gradient


def _congruence(a: Array, info: Array, b: Array) -> Array:
    """a' diag(info) b for batches of 3x3 matrices."""
    return (a[..., :, :, None] * (info[..., :, None] * b)[..., :, None, :]).sum(axis=-3)


def _add_limits(
    layout: Layout,
    body: Body,
    part: _Banded,
    gradient: Array,
    r: PoseResiduals,
    terms: Terms,
    core: slice,
) -> tuple[_Banded, Array]:
    joint_q, _, _ = limited_coordinates(body)
    if not len(joint_q):
        return part, gradient
    all_q, all_v = layout.topology.scalar_index
    value, slope = r.limits[core], r.limit_slopes[core]
    info = terms.limit_information[core][:, None]
    scalar = part.scalar + _among(info * slope**2, np.searchsorted(all_q, joint_q), len(all_q))
    place = all_v[np.searchsorted(all_q, joint_q)]
    pull = _among(info * slope * value, place, gradient.shape[1])
    return _Banded(scalar, part.rotation), gradient + pull


def _among(values: Float[Array, "c m"], place: np.ndarray, width: int) -> Float[Array, "c w"]:
    """Columns put at given places, zeros elsewhere."""
    source = np.full(width, values.shape[1])
    source[place] = np.arange(values.shape[1])
    return jnp.pad(values, ((0, 0), (0, 1)))[:, source]


def _add_smoothness(
    layout: Layout,
    parts: list[_Banded],
    gradient: Array,
    r: PoseResiduals,
    terms: Terms,
    weights: Weights,
    core: slice,
) -> tuple[list[_Banded], Array]:
    """Second or third differences: frame j of a window enters two successive increments."""
    order, topology = layout.smoothness_order, layout.topology
    scalars, quats = topology.scalar_index[1], topology.quat_index[1]
    c = smoothness_coefficients(order, weights.step)
    pad = jnp.concatenate([jnp.zeros(1), c, jnp.zeros(1)])
    scalar_weight = [pad[j] - pad[j + 1] for j in range(order + 1)]
    start, size = core.start, core.stop - core.start
    ahead, behind = increment_jacobians(r.increments[:, quats])
    # Information is stored at the second frame of the window, residual rows at the first.
    info = terms.smoothness_information[1 : 1 + r.smoothness.shape[0]]

    def rotation_jacobian(j: int, first: int) -> Array:
        """Derivative of windows first .. first + size by their frame j."""
        into = ahead[first + j - 1 : first + j - 1 + size] if j > 0 else 0.0
        out_of = behind[first + j : first + j + size] if j < order else 0.0
        return pad[j] * into + pad[j + 1] * out_of

    parts = list(parts)
    for earlier in range(order + 1):
        first = start - earlier
        rows = slice(first, first + size)
        wt, residual = info[rows], r.smoothness[rows]
        weighted = wt * residual
        pull = jnp.zeros((size, 0, 3), gradient.dtype)
        if len(quats):
            jac = rotation_jacobian(earlier, first)
            pull = (jac * weighted[:, quats][..., :, None]).sum(-2)
        gradient = gradient + _join(layout, scalar_weight[earlier] * weighted[:, scalars], pull)
        for later in range(earlier, order + 1):
            o = later - earlier
            scalar = scalar_weight[later] * scalar_weight[earlier] * wt[:, scalars]
            rotation = parts[o].rotation
            if len(quats):
                jac_later = rotation_jacobian(later, first)
                rotation = rotation + _congruence(jac_later, wt[:, quats], jac)
            parts[o] = _Banded(parts[o].scalar + scalar, rotation)
    return parts, gradient


def user_values(
    layout: Layout, body: Body, user: UserResidual, q: Array, data: Array, mask: Array
) -> Float[Array, "n m"]:
    """A user's residual for every window that starts in the chunk (zero where masked)."""
    n = q.shape[0] - user.window + 1
    windows = jnp.stack([q[i : i + n] for i in range(user.window)], axis=1)
    rows = jax.tree.map(lambda x: x[:n], data)
    values = jax.vmap(lambda w, d: user.function(body, w, d))(windows, rows)
    return jnp.where(mask[:n, None] > 0, values, 0.0)


def add_user_blocks(
    layout: Layout,
    body: Body,
    blocks: list[Array],
    gradient: Array,
    q: Array,
    terms: Terms,
    core: slice,
) -> tuple[list[Array], Array]:
    """Add the user's residuals, differentiated by JAX in the tangent space of their window."""
    start, size = core.start, core.stop - core.start
    for user, data, mask in zip(layout.user, terms.user_data, terms.user_mask, strict=True):
        value, jacobian = _user_jacobian(layout, body, user, q, data, mask)
        for earlier in range(user.window):
            rows = slice(start - earlier, start - earlier + size)
            jac = jacobian[rows, :, earlier]
            gradient = gradient + jnp.einsum("cmi,cm->ci", jac, value[rows])
            for later in range(earlier, user.window):
                block = jnp.einsum("cmi,cmj->cij", jacobian[rows, :, later], jac)
                blocks[later - earlier] = blocks[later - earlier] + block
    return blocks, gradient


def _user_jacobian(
    layout: Layout, body: Body, user: UserResidual, q: Array, data: Array, mask: Array
) -> tuple[Array, Array]:
    """Values (n, m) and Jacobians (n, m, window, nv)."""
    n, nv = q.shape[0] - user.window + 1, layout.topology.nv
    windows = jnp.stack([q[i : i + n] for i in range(user.window)], axis=1)
    rows = jax.tree.map(lambda x: x[:n], data)

    def value(delta: Array, window: Array, row: Array) -> Array:
        moved = jax.vmap(lambda x, d: retract(layout.topology, x, d))(window, delta)
        return user.function(body, moved, row)

    zero = jnp.zeros((user.window, nv), q.dtype)
    on = mask[:n] > 0
    values = jax.vmap(lambda w, d: value(zero, w, d))(windows, rows)
    jacobians = jax.vmap(lambda w, d: jax.jacfwd(value)(zero, w, d))(windows, rows)
    return (
        jnp.where(on[:, None], values, 0.0),
        jnp.where(on[:, None, None, None], jacobians, 0.0),
    )
