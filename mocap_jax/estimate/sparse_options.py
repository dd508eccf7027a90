"""Options for a few inertial boards that report their orientation."""

from __future__ import annotations

import dataclasses

from mocap_jax.estimate.contact.options import ContactOptions
from mocap_jax.estimate.whole_sequence_options import (
    ConstantsOptions,
    NoiseOptions,
    OptimiseOptions,
    PriorOptions,
)
from mocap_jax.pose_prior import PosePrior, default_pose_prior


def sparse_options(
    pose_prior: PosePrior | None = None, *, contacts: bool = False
) -> OptimiseOptions:
    """Options of `optimise` for few boards, such as the six of the Sparse Inertial Poser.

    Joints between two boards are told by accelerations: a board's path follows from them and
    nothing else. So what errs in accelerations at high frequencies alone, boards that shake on soft
    tissue, is solved for as displacement (`PriorOptions.skin_sigma`) and no longer counts as noise
    of accelerations, where what remains is:

    - timing: twice the clock offset of a few milliseconds (`lag`);
    - places of boards on their segments, which are solved for as constants (`lever_arm_sigma`);
    - drift of bias and scale in quiet moments (`accelerometer_model`).

    Poses follow wrong accelerations closely where boards are few, and residuals hide it: figures
    are not adapted to them.

    Args:
        pose_prior: what poses people take; default `default_pose_prior()`.
        contacts: hold standing feet (`ContactOptions`), so that the root hardly drifts.
    """
    return OptimiseOptions(
        kinds="AGO",
        initial="orientation",
        pose_prior=default_pose_prior() if pose_prior is None else pose_prior,
        constants=ConstantsOptions(adapt=False),
        contacts=ContactOptions() if contacts else None,
        prior=PriorOptions(skin_sigma=0.005),
        noise=NoiseOptions(lag=0.005, lever_arm_sigma=0.005, accelerometer_model=0.05, adapt=False),
    )


# Weights of von Marcard 2017, table 1.
_ACCELERATION, _MAHALANOBIS, _LIMITS = 0.05, 0.003, 0.1


def table1_options(
    rate_hz: float, sensors: int = 6, pose_prior: PosePrior | None = None
) -> OptimiseOptions:
    """Options with the weights of von Marcard 2017, table 1, and nothing of our own.

    Orientations and accelerations (plain second differences) with one weight each, the Mahalanobis
    distance of every frame, joint limits; no rates, constants, smoothness or robust losses. What
    stays: the declared rest pose, the root held during it, and even bends of the trunk's joints, of
    which our prior knows the sum.

    The paper's energies are means over frames and sensors; in units of one radian of one sensor, an
    acceleration has a deviation of 0.05^-1/2 m/s^2, and a frame counts as 0.003 poses a sensor.
    Accelerations are turned into the world by measured orientations (eq. 13). Place boards by
    `calibrate_to_pose` first (eq. 7).

    Args:
        rate_hz: of the frames.
        sensors: how many are used.
        pose_prior: what poses people take; default `default_pose_prior()`.
    """
    prior = default_pose_prior() if pose_prior is None else pose_prior
    loose = 1e8
    return OptimiseOptions(
        kinds="AO",
        stencil="plain",
        acceleration_rotation="measured",
        initial="orientation",
        root="free",
        pose_prior=dataclasses.replace(
            prior, correlation_time=1 / (rate_hz * sensors * _MAHALANOBIS), mobility=None
        ),
        constants=ConstantsOptions(
            gyroscope_bias_sigma=0.0, accelerometer_bias_sigma=0.0, mounting_sigma=0.0,
            offset_sigma=0.0, adapt=False,
        ),
        noise=NoiseOptions(
            lag=0.0, lever_arm_sigma=0.0, orientation_model=1.0,
            accelerometer_model=_ACCELERATION**-0.5, inertial_loss="none", adapt=False,
        ),
        prior=PriorOptions(
            smoothness_density=loose, shared_smoothness_density=loose, translation_density=loose,
            pose_sigma=1e3, knee_sigma=0.0, limit_sigma=(rate_hz * sensors * _LIMITS) ** -0.5,
        ),
        covariance=False,
    )  # fmt: skip
