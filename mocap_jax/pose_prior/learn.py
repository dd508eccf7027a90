"""Learn a pose prior from motions.

Poses of one clip are far from independent, and a handful of people do not show what all people do.
So clips count by the root of their duration, poses are mirrored, correlations are shrunk towards
none, and every rotation gets a floor of uncertainty (skeletons of motion files disagree by that
much about what upright is).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from mocap_jax.errors import InputError
from mocap_jax.pose_prior.prior import PosePrior
from mocap_jax.pose_prior.rotations import anatomical_joint_rotations, rotation_vectors

if TYPE_CHECKING:
    from mocap_jax.motion.motion import Motion

_TRUNK = (("L5", "Pelvis"), ("T8", "Pelvis"), ("Neck", "T8"), ("Head", "T8"))
_SIDED = (
    ("Shoulder", "T8"), ("UpperArm", "T8"), ("ForeArm", "UpperArm"), ("Hand", "ForeArm"),
    ("UpperLeg", "Pelvis"), ("LowerLeg", "UpperLeg"), ("Foot", "LowerLeg"),
)  # fmt: skip
_MIDDLE = ("T8", "Pelvis")
JOINTS: tuple[tuple[str, str], ...] = _TRUNK + tuple(
    (side + child, parent if parent in _MIDDLE else side + parent)
    for child, parent in _SIDED
    for side in ("Left", "Right")
)
"""Joints of the prior: child and parent segment, by Xsens names. Skeletons divide the trunk
differently, so the chest and what hangs on it count as a whole."""

_RATE = 30.0  # Hz: poses change little within a thirtieth of a second
# Both figures give the highest likelihood of people left out (scripts/learn_pose_prior --compare).
SHRINKAGE = 0.3
FLOOR = 0.1
# Changes of poses over this time count [s]; over less, motion goes on and changes are no walk.
_LAG = 0.25
# The least mobility: real joints are no perfect hinges [rad/sqrt(s)].
PACE_FLOOR = 0.05
_STEPS = 20
# Mean square of a clip's rotation vectors below which nothing moves [rad^2].
_STILL = 1e-12
# Reflection in the sagittal plane, in anatomical axes (Z points to the right).
_MIRROR = np.diag([1.0, 1.0, -1.0])


def learn_pose_prior(
    motions: Mapping[str, Motion],
    *,
    joints: Sequence[tuple[str, str]] = JOINTS,
    shrinkage: float = SHRINKAGE,
    floor: float = FLOOR,
    name: str = "learned",
) -> PosePrior:
    """Learn the prior of joint rotations from motions.

    Args:
        motions: by a name that the provenance shows; bodies with Xsens names.
        joints: pairs (child, parent) of segments that all bodies have; of a left one the right one
            as well, for poses are mirrored.
        shrinkage: share of every correlation that is taken away, 0 to 1.
        floor: standard deviation added to each component of every rotation [rad].
        name: what solutions call the prior.

    Raises:
        InputError: no motion, a body without one of the segments, a joint of one side alone, or
            figures out of range.
    """
    if not motions:
        raise InputError("learn_pose_prior: no motions")
    _check_sides(joints)
    if not 0 <= shrinkage <= 1 or not floor > 0:
        raise InputError(
            f"learn_pose_prior: shrinkage {shrinkage:g}, floor {floor:g}; valid: 0 to 1, above 0"
        )
    clips = {clip: thinned(motion, joints) for clip, motion in motions.items()}
    both = [r for clip in clips.values() for r in (clip, mirrored(clip, joints))]
    rotation = np.concatenate(both)
    weight = np.concatenate([np.full(len(r), len(r) ** -0.5) for r in both])
    weight /= weight.sum()
    mean, vectors = _centred(rotation, weight)
    spread = (vectors * weight[:, None]).T @ vectors
    spread = (1 - shrinkage) * spread + shrinkage * np.diag(np.diag(spread))
    facts: dict[str, str | float | int] = {
        "clips": ", ".join(clips),
        "poses": sum(len(c) for c in clips.values()),
        "shrinkage": shrinkage,
        "floor": floor,
    }
    mobility = _mobility(both, mean, shrinkage)
    return PosePrior(
        tuple(joints),
        Rotation.from_matrix(mean).as_quat(scalar_first=True),
        spread + floor**2 * np.eye(len(spread)),
        _correlation_time(list(clips.values())),
        mobility,
        name,
        facts,
    )


def _check_sides(joints: Sequence[tuple[str, str]]) -> None:
    for child, parent in joints:
        other = _other_side(child), _other_side(parent)
        if other not in joints:
            raise InputError(
                f"learn_pose_prior: joints: {child}/{parent} is there without {other[0]}/{other[1]}"
            )


def _mobility(
    clips: list[Float[np.ndarray, "t j 3 3"]], mean: Float[np.ndarray, "j 3 3"], shrinkage: float
) -> Float[np.ndarray, "3j 3j"]:
    """Covariance of changes per second; clips count by the root of their duration."""
    lag = round(_LAG * _RATE)
    long = [c for c in clips if len(c) > 2 * lag]
    size = 3 * len(mean)
    total, weight = PACE_FLOOR**2 * np.eye(size), 0.0
    squares = np.zeros((size, size))
    for clip in long:
        x = rotation_vectors(mean, clip)
        change = x[lag:] - x[:-lag]
        squares += len(clip) ** 0.5 * (change.T @ change) / (len(change) * lag / _RATE)
        weight += len(clip) ** 0.5
    if weight:
        squares /= weight
    return total + (1 - shrinkage) * squares + shrinkage * np.diag(np.diag(squares))


def thinned(motion: Motion, joints: Sequence[tuple[str, str]]) -> Float[np.ndarray, "t j 3 3"]:
    """Poses at `_RATE`, whatever the motion's own: between its frames on geodesics."""
    time, q = np.asarray(motion.trajectory.time), np.asarray(motion.trajectory.q)
    rotation = anatomical_joint_rotations(motion.body, q, joints)
    if len(time) < 2:
        return rotation
    at = time[0] + np.arange(int((time[-1] - time[0]) * _RATE + 1e-6) + 1) / _RATE
    slerps = [Slerp(time, Rotation.from_matrix(rotation[:, j])) for j in range(len(joints))]
    return np.stack([s(np.minimum(at, time[-1])).as_matrix() for s in slerps], axis=1)


def mirrored(
    rotation: Float[np.ndarray, "t j 3 3"], joints: Sequence[tuple[str, str]]
) -> Float[np.ndarray, "t j 3 3"]:
    """The same poses with left and right exchanged."""
    names = [child for child, _ in joints]
    other = [names.index(_other_side(n)) for n in names]
    return (_MIRROR @ rotation @ _MIRROR)[:, other]


def _other_side(name: str) -> str:
    for side, other in (("Left", "Right"), ("Right", "Left")):
        if name.startswith(side):
            return other + name.removeprefix(side)
    return name


def _centred(
    rotation: Float[np.ndarray, "n j 3 3"], weight: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "j 3 3"], Float[np.ndarray, "n 3j"]]:
    """Mean rotations, about which rotation vectors have mean zero, and those vectors."""
    U, _, V = np.linalg.svd(np.einsum("n,njab->jab", weight, rotation))
    U[..., 2] *= np.linalg.det(U @ V)[:, None]
    mean = U @ V
    for _ in range(_STEPS):
        vectors = rotation_vectors(mean, rotation)
        step = (weight @ vectors).reshape(-1, 3)
        if abs(step).max() < 1e-9:
            break
        mean = mean @ Rotation.from_rotvec(step).as_matrix()
    return mean, vectors


def _correlation_time(clips: list[Float[np.ndarray, "t j 3 3"]]) -> float:
    """Twice the integral of the autocorrelation of poses, up to where it has fallen to 0.1 [s].

    A sample mean over T seconds has the variance of T / this many independent poses.
    """
    total, count = np.zeros(1 + int(4 * _RATE)), np.zeros(1 + int(4 * _RATE))
    for clip in clips:
        _, x = _centred(clip, np.full(len(clip), 1 / len(clip)))
        for lag in range(min(len(total), len(x) // 2)):
            total[lag] += (x[: len(x) - lag] * x[lag:]).sum()
            count[lag] += len(x) - lag
    if total[0] <= _STILL * max(count[0], 1):
        return 1 / _RATE  # nobody moves: no pose says anything of the next
    correlation = total[count > 0] / count[count > 0]
    correlation /= correlation[0]
    low = np.flatnonzero(correlation < 0.1)
    last = int(low[0]) if len(low) else len(correlation)
    return float((2 * correlation[:last].sum() - 1) / _RATE)
