"""Errors of arm trackers against the truth of a simulated trial, in the rows of table II."""

from __future__ import annotations

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, frames, load_body
from mocap_jax.errors import InputError
from mocap_jax.motion.arm import ELBOW, SHOULDER
from mocap_jax.recording import Recording

ROWS = ("horizontal [cm]", "vertical [cm]", "shoulder [deg]", "elbow [deg]")
"""Rows of table II, and of `ArmErrors.mean` and `.std`."""
_WRIST = "RightHand"


class ArmPoints(NamedTuple):
    """Joint centres in the world [m]."""

    shoulder: Float[np.ndarray, "t 3"]
    elbow: Float[np.ndarray, "t 3"]
    wrist: Float[np.ndarray, "t 3"]


class ArmErrors(NamedTuple):
    """Mean and standard deviation of the error of each of `ROWS`, over all scored pulses."""

    mean: Float[np.ndarray, "4"]
    std: Float[np.ndarray, "4"]


def arm_points(body: Body, q: Float[np.ndarray, "t nq"]) -> ArmPoints:
    """Joint centres of an arm in some poses.

    Raises:
        InputError: the body is no arm (joints `shoulder` and `elbow`, segment `RightHand`).
    """
    topology = body.topology
    missing = [n for n in (SHOULDER, ELBOW) if n not in topology.joint_names]
    if missing or _WRIST not in topology.body_names:
        raise InputError(
            f"body: no arm: needs joints '{SHOULDER}' and '{ELBOW}' and a segment '{_WRIST}'; it "
            f"has joints {', '.join(topology.joint_names)}"
        )
    at = [topology.joint_body[topology.joint_names.index(n)] for n in (SHOULDER, ELBOW)]
    at.append(topology.body_names.index(_WRIST))
    position = np.asarray(jax.jit(jax.vmap(lambda x: frames(body, x).position))(np.asarray(q)))
    return ArmPoints(*(position[:, b] for b in at))


def reference_angles(points: ArmPoints) -> Float[np.ndarray, "t 2"]:
    """Shoulder and elbow angle as markers on shoulder, elbow and wrist show them [rad].

    The upper arm's angle above the horizontal in the sagittal plane, and the angle between upper
    arm and forearm.
    """
    upper, fore = points.elbow - points.shoulder, points.wrist - points.elbow
    shoulder = np.unwrap(np.arctan2(upper[:, 2], upper[:, 0]))
    across = np.linalg.norm(np.cross(upper, fore), axis=1)
    return np.stack([shoulder, np.arctan2(across, (upper * fore).sum(1))], axis=1)


def true_points(recording: Recording) -> ArmPoints:
    """Joint centres of the true arm at the truth's times; the wrist without its loose mobile.

    Raises:
        InputError: the recording has no truth.
    """
    truth = recording.truth
    if truth is None:
        raise InputError("the recording has no truth to compare with")
    body, q = load_body(truth.body_xml), np.array(truth.trajectory.q)
    for name, at in zip(body.topology.joint_names, body.topology.joint_qpos, strict=True):
        if name.startswith("mobile_"):
            q[:, at] = 0.0
    return arm_points(body, q)


def arm_errors(
    time: Float[np.ndarray, "t"],
    wrist: Float[np.ndarray, "t 3"],
    angles: Float[np.ndarray, "t 2"],
    recording: Recording,
    least_flexion: float = 0.0,
) -> ArmErrors:
    """Estimate less truth, from `Setup.score_from` on.

    Args:
        time: of the estimates [s].
        wrist: in the world [m].
        angles: of shoulder and elbow [rad].
        recording: with its truth.
        least_flexion: score only where the true elbow angle is at least this [rad].
    """
    points = true_points(recording)
    true = np.concatenate([points.wrist[:, [0, 2]], reference_angles(points)], axis=1)
    stamps = np.asarray(recording.truth.trajectory.time)  # type: ignore[union-attr]
    at = np.stack([np.interp(time, stamps, column) for column in true.T], axis=1)
    found = np.concatenate([np.asarray(wrist)[:, [0, 2]], np.asarray(angles)], axis=1)
    error = found - at
    error[:, 2:] -= 2 * np.pi * np.round(error[:, 2:] / (2 * np.pi))
    scale = np.array([100.0, 100.0, *np.rad2deg([1.0, 1.0])])
    scored = (time >= recording.setup.score_from) & (time <= stamps[-1])
    error = error[scored & (at[:, 3] >= least_flexion)] * scale
    return ArmErrors(error.mean(0), error.std(0))
