"""The pose prior in a whole-sequence problem.

Poses of neighbouring frames are alike, so a frame counts as the share of an independent pose that
its duration is of the prior's correlation time.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from mocap_jax import so3
from mocap_jax.body import Body
from mocap_jax.estimate.sequence.layout import Gaussian, Layout, Terms, Weights
from mocap_jax.estimate.sequence.window import Window
from mocap_jax.pose_prior import PosePrior
from mocap_jax.pose_prior.rotations import segment_pairs
from mocap_jax.pose_prior.shares import sharing_joints, unevenness
from mocap_jax.residuals.pose_prior import pose_prior_rotation
from mocap_jax.solution.anatomy import anatomical_frames


class OnBody(NamedTuple):
    """A prior's joints and figures on one body."""

    joints: tuple[tuple[int, int], ...]
    """Body indices of children and parents."""
    gaussian: Gaussian
    inside: np.ndarray
    """Mask (nv): degrees of freedom of these joints."""
    correlation_time: float
    """[s]"""


def on_body(body: Body, prior: PosePrior | None, share_sigma: float) -> OnBody | None:
    """The prior of the joints that a body has; None without a prior or any such joint.

    Args:
        body: the body.
        prior: over joints by name.
        share_sigma: how unevenly joints share what the prior knows of them together [rad].
    """
    own = None if prior is None else prior.of_segments(body.topology.body_names)
    if own is None or not own.joints:
        return None
    known = tuple((int(c), int(p)) for c, p in segment_pairs(body, own.joints))
    chains = sharing_joints(body.topology, known)
    joints = known + tuple(pair for chain in chains for pair in chain)
    frames, (child, parent) = anatomical_frames(body), np.array(joints).T
    mean = np.tile(np.eye(3), (len(joints), 1, 1))
    mean[: len(known)] = Rotation.from_quat(own.mean, scalar_first=True).as_matrix()
    whitening = block_diag(
        np.linalg.inv(np.linalg.cholesky(own.covariance)),
        *(unevenness(len(chain), share_sigma) for chain in chains),
    )
    return OnBody(
        joints, Gaussian(frames[child], frames[parent] @ mean, whitening),
        np.asarray(between(body, joints).any(axis=0)), own.correlation_time,
    )  # fmt: skip


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


def losses(
    x: Float[Array, "n j 3"], terms: Terms, weights: Weights, core: slice
) -> Float[Array, "c"]:
    """Squared Mahalanobis distance of the core frames, as much as a frame counts."""
    return terms.pose_information[core] * (whitened(x[core], weights) ** 2).sum(-1)


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
    """Add the prior to the diagonal block and the gradient of the core frames.

    A degree of freedom between parent and child with world axis a changes the rotation vector x by
    Jr^-1(x) (R_world_child R_child_frame)' a.
    """
    x = x[core]
    frame = so3.matmul3(w.child_rotation[core], weights.pose_prior.child_frame)
    turn = so3.matmul3(so3.right_jacobian_inverse(x), jnp.swapaxes(frame, -1, -2))
    axes = w.screws[core][:, None, 3:] * between(body, layout.pose_joints)[None, :, None, :]
    rows = sum(turn[..., p, None] * axes[:, :, p, None, :] for p in range(3))
    rows = rows.reshape(len(x), -1, axes.shape[-1])
    rows = jnp.einsum("ij,cjv->civ", weights.pose_prior.whitening, rows)
    info = terms.pose_information[core]
    square = jnp.einsum("civ,ciw->cvw", rows * info[:, None, None], rows)
    pull = jnp.einsum("civ,ci->cv", rows, info[:, None] * whitened(x, weights))
    return [blocks[0] + square, *blocks[1:]], gradient + pull
