"""Rotations: unit quaternions (wxyz), rotation vectors and matrices.

Every function takes one rotation (batch with `jax.vmap`) and has finite derivatives everywhere,
the identity and half turns included. `R_a_b` maps coordinates in frame b to frame a.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

# Below this squared angle the closed forms lose digits and series take over.
_SMALL_SQUARED = 1e-6


# One program instead of a dozen where they are called outside a traced function (first use would
# compile each operation); inside one they dissolve in it.
_compiled = partial(jax.jit, inline=True)


def cross(a: Float[Array, "*b 3"], b: Float[Array, "*b 3"]) -> Float[Array, "*b 3"]:
    """Cross product over the last axis, as multiply-adds (XLA fuses it, unlike `jnp.cross`)."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return jnp.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


@_compiled
def matmul3(a: Float[Array, "*b 3 3"], b: Float[Array, "*b 3 3"]) -> Float[Array, "*b 3 3"]:
    """Batched 3x3 product as multiply-sum, faster than a batched dot on CPU."""
    return (a[..., :, :, None] * b[..., None, :, :]).sum(axis=-2)


def matvec3(a: Float[Array, "*b 3 3"], x: Float[Array, "*b 3"]) -> Float[Array, "*b 3"]:
    """Batched 3x3 matrix times vector as multiply-sum."""
    return (a * x[..., None, :]).sum(axis=-1)


@_compiled
def skew(w: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """Matrix of the cross product, `skew(w) @ x == cross(w, x)`."""
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    o = jnp.zeros_like(x)
    return jnp.stack(
        [jnp.stack([o, -z, y], -1), jnp.stack([z, o, -x], -1), jnp.stack([-y, x, o], -1)], -2
    )


@_compiled
def quat_multiply(p: Float[Array, "*b 4"], q: Float[Array, "*b 4"]) -> Float[Array, "*b 4"]:
    """Hamilton product of quaternions (wxyz)."""
    pw, px, py, pz = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    qw, qx, qy, qz = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return jnp.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=-1,
    )


def quat_conjugate(q: Float[Array, "*b 4"]) -> Float[Array, "*b 4"]:
    """Conjugate, the inverse of a unit quaternion (wxyz)."""
    return q * jnp.array([1.0, -1.0, -1.0, -1.0], q.dtype)


@_compiled
def quat_normalise(q: Float[Array, "*b 4"]) -> Float[Array, "*b 4"]:
    """Scale to unit norm (wxyz)."""
    return q / jnp.sqrt((q * q).sum(axis=-1, keepdims=True))


def _half_sinc(squared: Array) -> tuple[Array, Array]:
    """Return cos(a/2) and sin(a/2)/a for a squared angle, with series near zero."""
    small = squared < _SMALL_SQUARED
    safe = jnp.where(small, 1.0, squared)
    angle = jnp.sqrt(safe)
    cosine = jnp.where(small, 1.0 - squared / 8 + squared**2 / 384, jnp.cos(angle / 2))
    ratio = jnp.where(small, 0.5 - squared / 48 + squared**2 / 3840, jnp.sin(angle / 2) / angle)
    return cosine, ratio


@_compiled
def quat_exp(w: Float[Array, "*b 3"]) -> Float[Array, "*b 4"]:
    """Unit quaternion (wxyz) of a rotation vector [rad]."""
    cosine, ratio = _half_sinc((w * w).sum(axis=-1))
    return jnp.concatenate([cosine[..., None], ratio[..., None] * w], axis=-1)


@_compiled
def quat_log(q: Float[Array, "*b 4"]) -> Float[Array, "*b 3"]:
    """Rotation vector [rad], of length at most pi, of a unit quaternion (wxyz)."""
    q = jnp.where(q[..., :1] < 0, -q, q)
    w, v = q[..., 0], q[..., 1:]
    squared = (v * v).sum(axis=-1)
    small = squared < _SMALL_SQUARED
    norm = jnp.sqrt(jnp.where(small, 1.0, squared))
    # w is kept away from zero in the unused branch so that its derivative stays finite.
    w_small = jnp.where(small, w, 1.0)
    ratio2 = squared / w_small**2
    series = 2.0 / w_small * (1.0 - ratio2 / 3 + ratio2**2 / 5)
    factor = jnp.where(small, series, 2.0 * jnp.arctan2(norm, w) / norm)
    return factor[..., None] * v


@_compiled
def quat_to_matrix(q: Float[Array, "*b 4"]) -> Float[Array, "*b 3 3"]:
    """Rotation matrix of a unit quaternion (wxyz)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return jnp.stack([jnp.stack(r, axis=-1) for r in rows], axis=-2)


@_compiled
def quat_from_matrix(R: Float[Array, "*b 3 3"]) -> Float[Array, "*b 4"]:
    """Unit quaternion (wxyz) of a rotation matrix, by the best-conditioned of four forms."""
    r = lambda i, j: R[..., i, j]  # noqa: E731
    trace = r(0, 0) + r(1, 1) + r(2, 2)
    candidates = jnp.stack(
        [
            jnp.stack([1 + trace, r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)], -1),
            jnp.stack(
                [r(2, 1) - r(1, 2), 1 + 2 * r(0, 0) - trace, r(0, 1) + r(1, 0), r(0, 2) + r(2, 0)],
                -1,
            ),
            jnp.stack(
                [r(0, 2) - r(2, 0), r(0, 1) + r(1, 0), 1 + 2 * r(1, 1) - trace, r(1, 2) + r(2, 1)],
                -1,
            ),
            jnp.stack(
                [r(1, 0) - r(0, 1), r(0, 2) + r(2, 0), r(1, 2) + r(2, 1), 1 + 2 * r(2, 2) - trace],
                -1,
            ),
        ],
        axis=-2,
    )
    diagonal = jnp.stack([trace, r(0, 0), r(1, 1), r(2, 2)], axis=-1)
    best = jnp.argmax(diagonal, axis=-1)
    chosen = jnp.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :]
    return quat_normalise(chosen)


@_compiled
def exp(w: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """Rotation matrix of a rotation vector [rad] (Rodrigues)."""
    return quat_to_matrix(quat_exp(w))


@_compiled
def log(R: Float[Array, "*b 3 3"]) -> Float[Array, "*b 3"]:
    """Rotation vector [rad], of length at most pi, of a rotation matrix."""
    return quat_log(quat_from_matrix(R))


def _right_jacobian_factors(squared: Array) -> tuple[Array, Array]:
    """Return (1 - cos a)/a^2 and (a - sin a)/a^3, with series near zero."""
    small = squared < 1e-4
    safe = jnp.where(small, 1.0, squared)
    angle = jnp.sqrt(safe)
    first = jnp.where(small, 0.5 - squared / 24 + squared**2 / 720, (1 - jnp.cos(angle)) / safe)
    second = jnp.where(
        small, 1 / 6 - squared / 120 + squared**2 / 5040, (angle - jnp.sin(angle)) / (safe * angle)
    )
    return first, second


@_compiled
def right_jacobian(w: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """Jr with exp(w + d) = exp(w) exp(Jr(w) d) to first order in d (Sola 2018, eq. 143)."""
    first, second = _right_jacobian_factors((w * w).sum(axis=-1))
    W = skew(w)
    eye = jnp.eye(3, dtype=w.dtype)
    return eye - first[..., None, None] * W + second[..., None, None] * matmul3(W, W)


@_compiled
def right_jacobian_inverse(w: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """Inverse of `right_jacobian`: log(exp(w) exp(d)) = w + Jr^-1(w) d to first order in d."""
    squared = (w * w).sum(axis=-1)
    small = squared < 1e-4
    safe = jnp.where(small, 1.0, squared)
    half = jnp.sqrt(safe) / 2
    closed = (1 - half / jnp.tan(half)) / safe
    factor = jnp.where(small, 1 / 12 + squared / 720 + squared**2 / 30240, closed)
    W = skew(w)
    eye = jnp.eye(3, dtype=w.dtype)
    return eye + 0.5 * W + factor[..., None, None] * matmul3(W, W)
