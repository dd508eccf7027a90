"""The pose prior in a whole-sequence problem.

Poses of neighbouring frames are alike, so a frame counts as the share of an independent pose that
its duration is of the prior's correlation time.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.body.topology import SLIDE
from mocap_jax.errors import InputError
from mocap_jax.estimate.sequence.layout import Gaussian, Layout, Terms, Weights
from mocap_jax.estimate.sequence.window import Window
from mocap_jax.pose_prior import PosePrior
from mocap_jax.pose_prior.rotations import joints_of, segment_pairs
from mocap_jax.pose_prior.shares import sharing_joints, unevenness
from mocap_jax.residuals.pose_prior import pose_prior_rotation, pose_prior_slopes
from mocap_jax.solution.anatomy import anatomical_frames


class OnBody(NamedTuple):
    """A prior's joints and figures on one body."""

    joints: tuple[tuple[int, int], ...]
    """Body indices of children and parents."""
    gaussian: Gaussian
    inside: np.ndarray
    """Mask (nv): degrees of freedom that turn these joints."""
    correlation_time: float
    """[s]"""


def on_body(body: Body, prior: PosePrior | None, share_sigma: float) -> OnBody | None:
    """The prior of the joints that a body has; None without a prior.

    Args:
        body: the body.
        prior: over joints by name.
        share_sigma: how unevenly joints share what the prior knows of them together [rad].

    Raises:
        InputError: the body has none of the prior's joints.
    """
    if prior is None:
        return None
    own = prior.of_joints(joints_of(body, prior.joints))
    if not own.joints:
        raise InputError(
            f"pose prior '{prior.name}': none of its joints is in this body, whose segments are "
            f"{', '.join(body.topology.body_names[1:])}; valid: a prior over these, or None"
        )
    known = tuple((int(c), int(p)) for c, p in segment_pairs(body, own.joints))
    chains = sharing_joints(body.topology, known)
    joints = known + tuple(pair for chain in chains for pair in chain)
    frames, (child, parent) = anatomical_frames(body), np.array(joints).T
    mean = np.tile(np.eye(3), (len(joints), 1, 1))
    mean[: len(known)] = Rotation.from_quat(own.mean, scalar_first=True).as_matrix()
    uneven = [unevenness(len(chain), share_sigma) for chain in chains]
    whitening = block_diag(_whitening(own.covariance), *uneven)
    pace = np.zeros_like(whitening)
    if own.mobility is not None:
        # Uneven bends may come and go within a second.
        pace = block_diag(_whitening(own.mobility), *uneven)
    return OnBody(
        joints, Gaussian(frames[child], frames[parent] @ mean, whitening, pace),
        between(body, joints).any(axis=0) & ~_slides(body), own.correlation_time,
    )  # fmt: skip


def _whitening(covariance: np.ndarray) -> np.ndarray:
    return np.linalg.inv(np.linalg.cholesky(covariance))


def _slides(body: Body) -> np.ndarray:
    """Mask (nv): degrees of freedom that turn nothing."""
    mask = np.zeros(body.nv, bool)
    for dof, kind in zip(body.topology.joint_dof, body.topology.joint_types, strict=True):
        mask[dof] = kind == SLIDE
    return mask


def between(body: Body, joints: tuple[tuple[int, int], ...]) -> np.ndarray:
    """Mask (j, nv): degrees of freedom that turn the child in the parent."""
    moved = np.asarray(body.topology.body_dofs)
    index = np.array(joints, int).reshape(-1, 2)
    return moved[index[:, 0]] & ~moved[index[:, 1]]


def residual(w: Window, weights: Weights) -> Float[Array, "n j 3"]:
    """Rotation vectors from the mean in all frames of a chunk [rad]."""
    own = weights.pose_prior
    return pose_prior_rotation(
        w.child_rotation, w.parent_rotation, own.child_frame, own.parent_mean
    )


def whitened(x: Float[Array, "n j 3"], weights: Weights) -> Float[Array, "n 3j"]:
    """Of unit covariance under the prior."""
    return x.reshape(len(x), -1) @ weights.pose_prior.whitening.T


def changes(x: Float[Array, "n j 3"], weights: Weights) -> Float[Array, "n-1 3j"]:
    """Whitened changes from each frame to the next [sqrt(s)]."""
    return moved(x[:-1], x[1:]) @ weights.pose_prior.pace.T


def moved(before: Float[Array, "n j 3"], after: Float[Array, "n j 3"]) -> Float[Array, "n 3j"]:
    """Changes of rotation vectors [rad]; none where a joint passes half a turn from the mean.

    There its vector jumps to the other end of the chart, which is no motion.
    """
    change = after - before
    far = (change**2).sum(-1, keepdims=True) > np.pi**2
    return jnp.where(far, 0.0, change).reshape(len(change), -1)


def losses(
    x: Float[Array, "n j 3"], terms: Terms, weights: Weights, core: slice
) -> Float[Array, "c"]:
    """Squared distance of the core frames, as much as a frame counts, and of changes after them."""
    away = terms.pose_information[core] * (whitened(x[core], weights) ** 2).sum(-1)
    return away + terms.pace_information[core] * (changes(x, weights)[core] ** 2).sum(-1)


def add_normal_blocks(
    layout: Layout,
    body: Body,
    w: Window,
    blocks: list[Array],
    gradient: Array,
    x: Float[Array, "n j 3"],
    terms: Terms,
    weights: Weights,
    core: slice,
) -> tuple[list[Array], Array]:
    """Add the prior to the blocks and the gradient of the core frames.

    With information matrices A of poses and B of changes, and derivatives J of frame k, the blocks
    are J_k' (A + B + B) J_k, for the changes before and after it, and -J_k+1' B J_k.
    """
    chosen = slice(core.start, core.stop + 1)
    rows = jax.lax.optimization_barrier(pose_prior_slopes(
        x[chosen], w.child_rotation[chosen], weights.pose_prior.child_frame,
        w.screws[chosen, 3:], between(body, layout.pose_joints),
    ))  # fmt: skip
    usual, pace = weights.pose_prior.whitening, weights.pose_prior.pace
    A, B = usual.T @ usual, pace.T @ pace
    info, before, after = (
        terms.pose_information[core],
        terms.pace_information[_shifted(core, -1)],
        terms.pace_information[core],
    )
    behind, here, ahead = (x[_shifted(core, k)] for k in (-1, 0, 1))
    came, goes = moved(behind, here), moved(here, ahead)
    force = (info[:, None] * here.reshape(len(here), -1)) @ A
    force = force + (before[:, None] * came - after[:, None] * goes) @ B
    gradient = gradient + jnp.einsum("civ,ci->cv", rows[:-1], force)
    stiff = jnp.einsum("ij,cjv->civ", B, rows[:-1])
    held = info[:, None, None] * jnp.einsum("ij,cjv->civ", A, rows[:-1])
    square = _product(rows[:-1], held + (before + after)[:, None, None] * stiff)
    coupling = -_product(rows[1:], after[:, None, None] * stiff)
    # Fused with the sums that follow, XLA computes parts of these products over and over.
    square, coupling = jax.lax.optimization_barrier((square, coupling))
    return [blocks[0] + square, blocks[1] + coupling, *blocks[2:]], gradient


def _shifted(core: slice, by: int) -> slice:
    return slice(core.start + by, core.stop + by)


def _product(a: Float[Array, "c i v"], b: Float[Array, "c i w"]) -> Float[Array, "c v w"]:
    return jnp.einsum("civ,ciw->cvw", a, b)
