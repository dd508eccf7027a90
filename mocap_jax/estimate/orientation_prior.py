"""The pose prior in the orientation pass, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from mocap_jax.body import Body, Frames
from mocap_jax.estimate.sequence.layout import Gaussian
from mocap_jax.estimate.sequence.pose_prior_terms import between, on_body
from mocap_jax.pose_prior import PosePrior
from mocap_jax.residuals.pose_prior import pose_prior_rotation, pose_prior_slopes


@dataclass(frozen=True, eq=False)
class FramePrior:
    """Whitened distance of one pose from the prior, and its derivatives.

    Equal ones are those of equal figures: programs are compiled once for them.
    """

    joints: tuple[tuple[int, int], ...]
    gaussian: Gaussian
    between: Bool[np.ndarray, "j nv"]
    """Degrees of freedom that turn each joint's child in its parent."""
    sigma: float
    """Deviation of a sensor's orientation of weight 1 [rad], the unit of all residuals."""

    @cached_property
    def _figures(self) -> tuple:
        arrays = (*self.gaussian, self.between)
        return self.joints, self.sigma, tuple(np.asarray(a).tobytes() for a in arrays)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FramePrior) and self._figures == other._figures

    def __hash__(self) -> int:
        return hash(self._figures)

    def __reduce__(self) -> tuple:  # without what was computed on the way: keys of programs
        return FramePrior, (self.joints, self.gaussian, self.between, self.sigma)

    def linearised(self, body: Body, f: Frames) -> tuple[Float[Array, "m"], Float[Array, "m nv"]]:
        """Residuals and derivatives in a pose of the given kinematics."""
        child, parent = np.array(self.joints).T
        own = self.gaussian
        x = pose_prior_rotation(
            f.rotation[child], f.rotation[parent], own.child_frame, own.parent_mean
        )
        rows = pose_prior_slopes(
            x, f.rotation[child], jnp.asarray(own.child_frame), f.angular.T, self.between
        )
        whitening = self.sigma * own.whitening
        return whitening @ x.ravel(), whitening @ rows


def frame_prior(
    body: Body, prior: PosePrior | None, sigma: float, share_sigma: float
) -> FramePrior | None:
    """The prior of the joints that a body has; None without a prior or any such joint."""
    own = on_body(body, prior, share_sigma)
    if own is None:
        return None
    return FramePrior(own.joints, own.gaussian, between(body, own.joints), sigma)
