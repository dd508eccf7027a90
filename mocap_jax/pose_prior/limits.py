"""`JointLimits`: how far joints turn, of joints without hinges, learned from motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError
from mocap_jax.pose_prior.learn import mirrored, thinned
from mocap_jax.pose_prior.prior import PosePrior
from mocap_jax.pose_prior.rotations import rotation_vectors

if TYPE_CHECKING:
    from mocap_jax.motion.motion import Motion


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Ranges of the rotation vectors of joints (von Marcard 2017, eq. 19), as in `PosePrior`.

    Raises:
        InputError: shapes that do not agree, or a lower limit above the upper one.
    """

    joints: tuple[tuple[str, str], ...]
    """Child and parent segment of every joint, by Xsens names."""
    mean: Float[np.ndarray, "j 4"]
    """R_parent_child of the anatomical frames from which vectors count (wxyz)."""
    lower: Float[np.ndarray, "j 3"]
    """In the child's frame: about forward, up, right [rad]; -inf where there is none."""
    upper: Float[np.ndarray, "j 3"]
    """[rad]"""

    def __post_init__(self) -> None:
        n = len(self.joints)
        for name, width in (("mean", 4), ("lower", 3), ("upper", 3)):
            values = np.asarray(getattr(self, name), float)
            object.__setattr__(self, name, values)
            if values.shape != (n, width):
                raise InputError(
                    f"joint limits: {name} has shape {values.shape}; {n} joints need ({n}, {width})"
                )
        if not (self.lower <= self.upper).all():
            bad = self.joints[int(np.argmax(~(self.lower <= self.upper).all(axis=1)))]
            raise InputError(f"joint limits of {bad[0]} in {bad[1]}: lower is above upper")


def learn_joint_limits(
    motions: Mapping[str, Motion], prior: PosePrior, *, share: float = 0.001, margin: float = 0.1
) -> JointLimits:
    """Limits within which the joints of motions, and of their mirror images, stay.

    Args:
        motions: by name; bodies with Xsens names.
        prior: over which joints, and from which mean rotations.
        share: of the poses that may be outside at either end.
        margin: by which limits are wider [rad].

    Raises:
        InputError: no motion, a body without one of the segments, or figures out of range.
    """
    if not motions:
        raise InputError("learn_joint_limits: no motions")
    if not (0 <= share < 0.5 and margin >= 0):
        raise InputError(
            f"learn_joint_limits: share {share:g}, margin {margin:g}; valid: 0 to 0.5, 0 or more"
        )
    clips = [thinned(motion, prior.joints) for motion in motions.values()]
    rotation = np.concatenate([r for clip in clips for r in (clip, mirrored(clip, prior.joints))])
    mean = Rotation.from_quat(prior.mean, scalar_first=True).as_matrix()
    vectors = rotation_vectors(mean, rotation).reshape(len(rotation), -1, 3)
    return JointLimits(
        prior.joints, prior.mean,
        np.quantile(vectors, share, axis=0) - margin,
        np.quantile(vectors, 1 - share, axis=0) + margin,
    )  # fmt: skip
