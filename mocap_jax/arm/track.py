"""Trackers of an arm on the same ranges: the paper's, the general filter, the optimiser."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax import so3
from mocap_jax.arm.errors import ArmErrors, arm_errors, arm_points, reference_angles
from mocap_jax.arm.inverse_kinematics import planar_angles
from mocap_jax.arm.mirror import bent_forward
from mocap_jax.arm.ranges import anchor_ranges
from mocap_jax.arm.wrist_filter import WristFilterOptions, wrist_filter
from mocap_jax.body import Body, load_body, site_frames
from mocap_jax.errors import InputError
from mocap_jax.estimate import (
    EkfOptions,
    NoiseOptions,
    OptimiseOptions,
    PriorOptions,
    optimise,
    ukf,
)
from mocap_jax.initialise import declared_pose
from mocap_jax.motion.arm import SHOULDER, WRIST_SITE
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution


@dataclass(frozen=True)
class ArmTrack:
    """Wrist and joint angles of an arm over time."""

    time: Float[np.ndarray, "t"]
    """[s]"""
    wrist: Float[np.ndarray, "t 3"]
    """In the world [m]."""
    angles: Float[np.ndarray, "t 2"]
    """Of shoulder and elbow, as `reference_angles` [rad]."""
    clamped: Bool[np.ndarray, "t"]
    """The wrist was out of the arm's reach (inverse kinematics only)."""
    solution: Solution | None = None
    """Of the general estimators."""
    log_likelihood: float = float("nan")
    """Of the innovations of the paper's filter."""
    remarks: tuple[str, ...] = ()

    def errors(self, recording: Recording, least_flexion: float = 0.0) -> ArmErrors:
        """Against the recording's truth (see `arm_errors`)."""
        return arm_errors(self.time, self.wrist, self.angles, recording, least_flexion)


def paper_tracker(recording: Recording, options: WristFilterOptions | None = None) -> ArmTrack:
    """The paper's system: the wrist in its plane by a UKF, then the angles by inverse kinematics.

    Args:
        recording: with a declared arm and its start pose; the plane is x, z through the shoulder.
        options: of the filter; default the declared range noise.
    """
    ranges, body = anchor_ranges(recording), _body(recording)
    start = declared_pose(recording.setup.rest, body)
    points = arm_points(body, start[None])
    shoulder, elbow, wrist = (p[0] for p in points)
    mobile = np.asarray(site_frames(body, start).position)[body.site_index(WRIST_SITE)]
    options = options or WristFilterOptions(range_sigma=recording.setup.noise.range)
    found = wrist_filter(
        ranges.distance, ranges.anchors[:, [0, 2]], wrist[[0, 2]],
        ranges.anchors[:, 1] - mobile[1], options,
    )  # fmt: skip
    plane = np.asarray(found.position)
    lengths = tuple(float(np.linalg.norm(d)) for d in (elbow - shoulder, wrist - elbow))
    angles = planar_angles(plane - shoulder[[0, 2]], (lengths[0], lengths[1]), one_way=True)
    clamped = np.asarray(angles.clamped)
    told = (
        f"Out of reach in {100 * clamped.mean():.1f} % of the pulses: the elbow is clamped there.",
    )
    return ArmTrack(
        ranges.time,
        np.stack([plane[:, 0], np.full(len(plane), shoulder[1]), plane[:, 1]], axis=1),
        np.stack([angles.shoulder, angles.elbow], axis=1),
        clamped,
        log_likelihood=float(found.log_likelihood),
        remarks=told if clamped.any() else (),
    )


JERK_DENSITY = 300.0
"""Of joint angles in flexion and extension [rad^2/s^5]: beyond it the elbow's error falls no
further in a trial used for nothing else (`scripts/reproduce_arm_ukf --tune`). What people do beside
(`EkfOptions.joint_jerk_density`) is thirty times as lively."""
LOOSE_MOBILE = 0.005
"""What a mobile that is loose on the wrist adds to the noise of ranges [m]. A filter takes it for
white: 2 mm an axis within 8 of the 25 Hz that 50 pulses a second can show count as 3.5 mm. All
anchors see it alike, while their own noise averages out to 0.7 of itself in a position."""


def filter_options(rate_hz: float, *, smooth: bool = False) -> EkfOptions:
    """Options of the joint-angle filter.

    Args:
        rate_hz: of the frames.
        smooth: run the backward pass too.
    """
    return EkfOptions(
        kinds="D",
        rate_hz=rate_hz,
        joint_jerk_density=JERK_DENSITY,
        limits=True,
        smooth=smooth,
        # Which way the mobile faces is what the wrist's position tells least.
        range_facing=False,
    )


def joint_filter(
    recording: Recording, body: Body | None = None, *, smooth: bool = False
) -> ArmTrack:
    """The UKF on joint angles directly (`ukf`), at the rate of the pulses.

    Args:
        recording: with its start pose declared for the body.
        body: default the recording's.
        smooth: run the backward pass too.
    """
    options = filter_options(_rate(recording), smooth=smooth)
    return tracked(bent_forward(ukf(loosened(recording), body, options=options)))


def loosened(recording: Recording) -> Recording:
    """The recording with `LOOSE_MOBILE` in its stated noise."""
    noise = recording.setup.noise
    noise = replace(noise, range=float(np.hypot(noise.range, LOOSE_MOBILE)))
    return replace(recording, setup=replace(recording.setup, noise=noise))


def arm_options(rate_hz: float, *, robust: bool = True) -> OptimiseOptions:
    """Options of the whole-sequence optimiser with the filter's own process and noise.

    Args:
        rate_hz: of the frames.
        robust: Cauchy's loss on ranges; otherwise least squares.
    """
    filtering = filter_options(rate_hz)
    return OptimiseOptions(
        kinds="D",
        rate_hz=rate_hz,
        # The arm's lengths and the mobile's place are taken as known, as in the paper.
        noise=NoiseOptions(
            model_errors=False, adapt=False, range_loss="cauchy" if robust else "none",
            range_facing=False,
        ),
        prior=PriorOptions(
            smoothness_order=3, smoothness_density=filtering.joint_jerk_density,
            translation_density=filtering.root_translation_jerk_density, limits=True,
        ),
    )  # fmt: skip


def optimised(
    recording: Recording, body: Body | None = None, *, robust: bool = True,
    initial: ArmTrack | None = None,
) -> ArmTrack:  # fmt: skip
    """The whole trial at once (`optimise`) on the same ranges.

    Args:
        recording: with its start pose declared for the body.
        body: default the recording's.
        robust: see `arm_options`.
        initial: where to start; default the smoothed `joint_filter`.
    """
    initial = initial or joint_filter(recording, body, smooth=True)
    options = arm_options(_rate(recording), robust=robust)
    found = optimise(loosened(recording), body, initial=initial.solution, options=options)
    return tracked(found)


def _body(recording: Recording) -> Body:
    if recording.body_xml is None:
        raise InputError("the recording carries no body.xml")
    return load_body(recording.body_xml)


def _rate(recording: Recording) -> float:
    """Of the mobile's pulses [Hz]."""
    return 1.0 / (recording.setup.pulse_interval * len(recording.setup.sources))


def tracked(solution: Solution) -> ArmTrack:
    """What a general estimator found, as wrist and angles."""
    q = np.asarray(solution.trajectory.q)
    points = arm_points(solution.body, q)
    told = solution.remarks
    swivel = swivel_deviation(solution)
    if swivel is not None:
        told = (
            *told,
            "A wrist position does not determine the swivel about the line from shoulder to wrist: "
            f"its standard deviation is {np.rad2deg(np.median(swivel)):.0f} degrees in the median.",
        )
    return ArmTrack(
        np.asarray(solution.trajectory.time), points.wrist, reference_angles(points),
        np.zeros(len(q), bool), solution, remarks=told,
    )  # fmt: skip


def swivel_deviation(solution: Solution) -> Float[np.ndarray, "t"] | None:
    """Standard deviation of an arm's swivel about the line from shoulder to wrist [rad].

    None for a planar arm, which has none, and without a covariance.
    """
    topology = solution.body.topology
    joint = topology.joint_names.index(SHOULDER)
    if topology.joint_types[joint] != "ball" or solution.covariance is None:
        return None
    q = np.asarray(solution.trajectory.q)
    points = arm_points(solution.body, q)
    line = points.wrist - points.shoulder
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    at, dof = topology.joint_qpos[joint], topology.joint_dof[joint]
    # The root stands upright: world axes are those before the joint.
    R = np.asarray(so3.quat_to_matrix(q[:, at : at + 4]))
    axis = np.einsum("tij,ti->tj", R, line)
    P = np.asarray(solution.covariance)[:, dof : dof + 3, dof : dof + 3]
    return np.sqrt(np.einsum("ti,tij,tj->t", axis, P, axis))
