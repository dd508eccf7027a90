"""Limits of joints that have no hinges, as a residual (von Marcard 2017, eq. 19)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, frames
from mocap_jax.errors import InputError
from mocap_jax.estimate.sequence.user_residuals import UserResidual, frame_step
from mocap_jax.pose_prior import JointLimits
from mocap_jax.pose_prior.rotations import joints_of, segment_pairs
from mocap_jax.residuals.joint_space import limit_violation
from mocap_jax.residuals.pose_prior import pose_prior_rotation
from mocap_jax.solution.anatomy import anatomical_frames


@dataclass(frozen=True)
class _Limits:
    """`UserResidual.function`: whitened amounts by which rotation vectors leave their ranges."""

    segments: tuple[tuple[int, int], ...]
    """Body indices of children and parents."""
    softness: float

    def __call__(
        self, body: Body, q: Float[Array, "1 nq"], data: dict[str, Array]
    ) -> Float[Array, "m"]:
        child, parent = np.array(self.segments).T
        rotation = frames(body, q[0]).rotation
        x = pose_prior_rotation(
            rotation[child], rotation[parent], data["child_frame"], data["parent_mean"]
        )
        beyond = limit_violation(x, data["lower"], data["upper"], self.softness)
        return (data["root_information"] * beyond).ravel()


def joint_limits(
    limits: JointLimits,
    body: Body,
    time: Float[np.ndarray, "t"],
    *,
    sigma: float = 0.03,
    softness: float = 0.01,
) -> tuple[UserResidual, dict[str, np.ndarray]]:
    """A residual for `OptimiseOptions.user_residuals`, and its data for `optimise`.

    Hinges and slides have their own limits (`PriorOptions.limits`); these are for ball joints.

    Args:
        limits: of joints by Xsens names; those that the body lacks are left out.
        body: the body.
        time: of the frames, `gather(recording, body).time` [s].
        sigma: standard deviation of a violation that lasts a second [rad].
        softness: width of the transition at a limit [rad].

    Returns:
        The residual "joint_limits" and its rows.

    Raises:
        InputError: the body has none of the joints, figures are not above zero, or fewer than two
            frames.
    """
    if not (sigma > 0 and softness > 0):
        raise InputError("joint limits: sigma and softness must be above 0")
    step = frame_step(time, "joint limits")
    own = joints_of(body, limits.joints)
    if not own:
        raise InputError(
            "joint limits: none of their joints is in this body, whose segments are "
            + ", ".join(body.topology.body_names[1:])
        )
    at = [limits.joints.index(pair) for pair in own]
    child, parent = segment_pairs(body, own).T
    anatomical = anatomical_frames(body)
    mean = Rotation.from_quat(limits.mean[at], scalar_first=True).as_matrix()
    row = {
        "child_frame": anatomical[child], "parent_mean": anatomical[parent] @ mean,
        "lower": limits.lower[at], "upper": limits.upper[at],
        "root_information": np.asarray(np.sqrt(step) / sigma),
    }  # fmt: skip
    rows = {name: np.broadcast_to(x, (len(time), *x.shape)) for name, x in row.items()}
    segments = tuple((int(c), int(p)) for c, p in zip(child, parent, strict=True))
    return UserResidual("joint_limits", _Limits(segments, softness), 1), rows
