"""`find_joint`: centre, kind and axes of the joint between two sensors, from motion alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.initialise.joint.axes import Axes, Motion, hinge_axes, relative_rate, universal_axes
from mocap_jax.initialise.joint.centre import Centre, joint_centre
from mocap_jax.initialise.joint.finding import JointFinding, JointKind
from mocap_jax.initialise.joint.options import JointOptions
from mocap_jax.initialise.joint.readings import Pair, check_motion, pair_of
from mocap_jax.recording import Recording

# A direction whose information is not this much above what noise makes up is not determined.
_ABOVE_NOISE = 4.0


def find_joint(
    recording: Recording,
    first: str,
    second: str,
    options: JointOptions = JointOptions(),  # noqa: B008  (frozen)
) -> JointFinding:
    """Find the joint between two segments from the readings of a sensor on each.

    Nothing is known of where and how the sensors are mounted, nor of the joint; no pose and no
    magnetometer is needed, but motion: turns in several directions, of some rad/s.

    Args:
        recording: with accelerometers and gyroscopes of both.
        first: sensor on the one side of the joint (the parent's, of a body).
        second: sensor on the other.
        options: see `JointOptions`.

    Returns:
        Lever arms, kind and axes with their uncertainty; what is not determined is said.

    Raises:
        InputError: unknown sensors, readings missing or too short, or no relative motion.
    """
    pair = pair_of(recording, first, second, options)
    centre = joint_centre(pair, options)
    gyroscope_bias = centre.constants[6:12].reshape(2, 3)
    shift = np.array([0.0, centre.constants[-1]])[:, None, None]
    rate = pair.rate + shift * pair.turn - gyroscope_bias[None, :, None]
    relative = relative_rate(centre.R_first_second, rate)
    relative = np.where(pair.known[..., None], relative, 0.0)
    motion = Motion(centre.R_first_second, relative, check_motion(relative, first, second))
    kind, axes, off = _kind(motion, options)
    directions = _undetermined(centre, axes if kind == "hinge" else None, options)
    arms, covariance = _without(centre, directions, options)
    relative = Rotation.from_matrix(centre.R_first_second.reshape(-1, 3, 3))
    return JointFinding(
        sensors=(first, second), kind=kind, off_axis=off, first_arm=arms[:3], second_arm=arms[3:],
        arm_covariance=covariance, undetermined=directions,
        first_axis=None if axes is None else axes.first,
        second_axis=None if axes is None else axes.second,
        axis_std=None if axes is None else axes.std,
        time=pair.time.ravel(), relative=relative.as_quat(scalar_first=True),
        start=_upright(centre, pair), gyroscope_bias=gyroscope_bias,
        clock_offset=float(centre.constants[-1]), residual=centre.residual,
        explained=_explained(centre, pair),
    )  # fmt: skip


def _kind(motion: Motion, options: JointOptions) -> tuple[JointKind, Axes | None, dict[str, float]]:
    """The simplest joint that the relative rates allow."""
    one = hinge_axes(motion)
    off = {"hinge": one.off}
    if one.off < options.off_axis:
        return "hinge", one, off
    two = universal_axes(motion)
    off["universal"] = two.off
    if two.off < options.off_axis:
        return "universal", two, off
    return "ball", None, off


def _undetermined(
    centre: Centre, hinge: Axes | None, options: JointOptions
) -> Float[np.ndarray, "k 6"]:
    """Directions of both arms that the motion does not tell."""
    known = np.zeros((0, 6))
    if hinge is not None:
        known = np.concatenate([hinge.first, hinge.second])[None] / np.sqrt(2)
    rest = np.eye(6) - known.T @ known
    values, vectors = np.linalg.eigh(rest @ centre.arm_information @ rest)
    found = []
    for value, direction in zip(values[len(known) :], vectors.T[len(known) :], strict=True):
        deviation = np.sqrt(direction @ centre.arm_covariance @ direction)
        noise = _ABOVE_NOISE * centre.noise_information
        if value < noise or deviation > options.determined:
            found.append(direction)
    return np.concatenate([known, np.reshape(found, (-1, 6))])


def _without(
    centre: Centre, directions: np.ndarray, options: JointOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Arms and covariance in which undetermined directions have the prior's."""
    prior = directions.T @ directions
    rest = np.eye(6) - prior
    arms = centre.constants[:6]
    covariance = centre.arm_covariance + _by_scale(arms, options.scale_sigma)
    covariance = rest @ covariance @ rest + options.arm_sigma**2 * prior
    return rest @ arms, covariance


def _by_scale(arms: np.ndarray, sigma: float) -> Float[np.ndarray, "6 6"]:
    """Covariance by errors of scale: of an arm s (accelerations) and 2 s (rates squared) along
    itself, and s across itself, since axes have errors of their own."""
    out = np.zeros((6, 6))
    for at in (slice(0, 3), slice(3, 6)):
        arm = arms[at]
        out[at, at] = sigma**2 * (arm @ arm * np.eye(3) + 4 * np.outer(arm, arm))
    return out


def _upright(centre: Centre, pair: Pair) -> Float[np.ndarray, "4"]:
    """Orientation of the first sensor at the start: the mean force in the joint is up."""
    up = centre.force[0][pair.known[0]].mean(0)
    return Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])[0].as_quat(scalar_first=True)


def _explained(centre: Centre, pair: Pair) -> float:
    """Share of the variance of the forces in the joint, about the windows' means."""
    known = pair.known[..., None]
    mean = (centre.force * known).sum(1, keepdims=True) / known.sum(1, keepdims=True)
    variance = ((centre.force - mean) ** 2 * known).sum() / (3 * known.sum())
    return float(np.clip(1 - centre.residual**2 / max(variance, 1e-12), 0.0, 1.0))
