"""`PosePrior`: a Gaussian over the rotations of joints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError
from mocap_jax.pose_prior.rotations import rotation_vectors

# Unit quaternions and symmetric matrices of a file may differ from that by this much.
_TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class PosePrior:
    """Gaussian over joint rotations (von Marcard 2017, eq. 18, with its own mean per joint).

    A joint is a pair of segments with Xsens names; its rotation is that of the child's anatomical
    frame in the parent's (`mocap_jax.solution`), so that one prior serves all bodies. With the
    mean rotation M and a rotation R of a joint, x = log(M' R) [rad]; all x together have mean zero
    and the covariance given here.

    Raises:
        InputError: shapes that do not agree, quaternions that are not of unit length, or a
            covariance that is not symmetric and positive definite.
    """

    joints: tuple[tuple[str, str], ...]
    """Child and parent segment of every joint."""
    mean: Float[np.ndarray, "j 4"]
    """R_parent_child of the anatomical frames (wxyz)."""
    covariance: Float[np.ndarray, "3j 3j"]
    """Of the rotation vectors, in the child's frame at the mean [rad^2]."""
    correlation_time: float
    """Poses this far apart are about independent of each other [s]."""
    mobility: Float[np.ndarray, "3j 3j"] | None = None
    """Covariance of the change of the rotation vectors over a quarter of a second, per second
    [rad^2/s]; None where it is not known."""
    name: str = ""
    """What solutions call it."""
    provenance: dict[str, str | float | int] = field(default_factory=dict)
    """What it was learned from."""

    def __post_init__(self) -> None:
        n = len(self.joints)
        object.__setattr__(self, "mean", np.asarray(self.mean, float))
        object.__setattr__(self, "covariance", np.asarray(self.covariance, float))
        shapes: dict[str, tuple[int, int]] = {"mean": (n, 4), "covariance": (3 * n, 3 * n)}
        if self.mobility is not None:
            object.__setattr__(self, "mobility", np.asarray(self.mobility, float))
            shapes["mobility"] = (3 * n, 3 * n)
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InputError(
                    f"pose prior: {name} has shape {getattr(self, name).shape}; "
                    f"{n} joints need {shape}"
                )
        if len({child for child, _ in self.joints}) < n:
            raise InputError("pose prior: a child segment is there twice; joints must differ")
        if not (abs(np.linalg.norm(self.mean, axis=1) - 1) < _TOLERANCE).all():
            raise InputError("pose prior: mean holds quaternions (wxyz) that are not of length 1")
        if not self.correlation_time > 0:
            raise InputError(f"pose prior: correlation_time {self.correlation_time}: must be > 0")
        _check_covariance("covariance", self.covariance)
        if self.mobility is not None:
            _check_covariance("mobility", self.mobility)

    def of_segments(self, names: Iterable[str]) -> PosePrior:
        """The prior (a marginal one) of the joints whose segments are both among the names."""
        known = set(names)
        return self.of_joints([joint for joint in self.joints if set(joint) <= known])

    def of_joints(self, joints: Iterable[tuple[str, str]]) -> PosePrior:
        """The prior (a marginal one) of some of its joints, pairs of child and parent."""
        chosen = set(joints)
        kept = [i for i, joint in enumerate(self.joints) if joint in chosen]
        rows = (3 * np.array(kept, int)[:, None] + np.arange(3)).ravel()
        return PosePrior(
            tuple(self.joints[i] for i in kept), self.mean[kept],
            self.covariance[np.ix_(rows, rows)], self.correlation_time,
            None if self.mobility is None else self.mobility[np.ix_(rows, rows)],
            self.name, self.provenance,
        )  # fmt: skip

    def deviations(self, rotation: Float[np.ndarray, "*b j 3 3"]) -> Float[np.ndarray, "*b 3j"]:
        """Rotation vectors [rad] from the mean to given rotations of all joints."""
        mean = Rotation.from_quat(self.mean, scalar_first=True).as_matrix()
        return rotation_vectors(mean, rotation)

    def mahalanobis(self, rotation: Float[np.ndarray, "*b j 3 3"]) -> Float[np.ndarray, "*b"]:
        """Squared Mahalanobis distance of poses (von Marcard 2017, eq. 18).

        Args:
            rotation: R_parent_child of the anatomical frames of all joints
                (`anatomical_joint_rotations`).
        """
        x = self.deviations(rotation)
        return (x * np.linalg.solve(self.covariance, x[..., None])[..., 0]).sum(-1)


def _check_covariance(name: str, matrix: np.ndarray) -> None:
    if not np.isfinite(matrix).all() or (abs(matrix - matrix.T) > _TOLERANCE).any():
        raise InputError(f"pose prior: the {name} is not symmetric or not finite")
    if len(matrix) and np.linalg.eigvalsh(matrix)[0] <= 0:
        raise InputError(f"pose prior: the {name} is not positive definite")
