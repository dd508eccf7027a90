"""The two-segment rig through the whole-sequence optimiser: options, and the error measure."""

from __future__ import annotations

import dataclasses

import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, load_body
from mocap_jax.estimate.joint_axes import joint_axes
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.estimate.whole_sequence import optimise
from mocap_jax.estimate.whole_sequence_options import (
    ConstantsOptions,
    NoiseOptions,
    OptimiseOptions,
    PriorOptions,
)
from mocap_jax.initialise import JointFinding, find_joint, joint_recording
from mocap_jax.io.two_segment_rig import SENSORS, RigTrial
from mocap_jax.measurement import gather
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution

# The rig stays on its bench: deviation of the joint's position, per second of recording [m].
_BENCH = 0.5


def _on_the_bench(body: Body, q: Float[Array, "1 nq"], whitening: Array) -> Float[Array, "3"]:
    """The joint's position, whitened: all that keeps a free root from drifting off."""
    return q[0, :3] * whitening


RIG_OPTIONS = OptimiseOptions(
    kinds="AG",
    root="free",
    # Sensors are glued to the rig, and orientations are compared in their frames: no mounting
    # rotation. Their positions are measured with a ruler.
    constants=ConstantsOptions(mounting_sigma=0.0, offset_sigma=0.005, adapt=False),
    # Nothing soft: the declared noise is all there is.
    noise=NoiseOptions(model_errors=False, adapt=False),
    # Not a person: a rig is swung faster than limbs, and its joint has no usual pose.
    prior=PriorOptions(
        smoothness_density=600.0, translation_density=100.0, pose_sigma=10.0, limits=False
    ),
    covariance=False,
    chunk=512,
    user_residuals=(UserResidual("bench", _on_the_bench),),
)
"""One setting for all trials; the reasons stand in docs/two_segment_rig.md."""


def estimate_rig(trial: RigTrial, options: OptimiseOptions = RIG_OPTIONS) -> Solution:
    """Run `optimise` on a trial.

    Args:
        trial: as read; its reference is not used beyond the declared pose of the first sample.
        options: must hold the residual "bench" of `RIG_OPTIONS`.
    """
    return optimise(
        trial.recording, trial.body, options=options, user_data=(_bench_rows(trial.recording),)
    )


def estimate_unknown_rig(
    trial: RigTrial, options: OptimiseOptions = RIG_OPTIONS
) -> tuple[JointFinding, Solution]:
    """Find the joint from the readings alone, then run `optimise` on the body found.

    Neither the file's lever arms nor the reference's start pose are used. The body has a ball
    joint, kept near the axes that were found.

    Args:
        trial: as read.
        options: as of `estimate_rig`.
    """
    finding = find_joint(trial.recording, *SENSORS)
    recording = joint_recording(trial.recording, finding, kind="ball")
    rows: tuple = (_bench_rows(recording),)
    if finding.kind != "ball":
        assert recording.body_xml is not None
        body = load_body(recording.body_xml)
        residual, whitening = joint_axes(finding, body, gather(recording, body).time)
        users = (*options.user_residuals, residual)
        options, rows = dataclasses.replace(options, user_residuals=users), (*rows, whitening)
    return finding, optimise(recording, options=options, user_data=rows)


def _bench_rows(recording: Recording) -> np.ndarray:
    """Whitening of the joint's position, frame by frame [1/m]."""
    rate = recording.setup.sensors[0].rate_hz
    return np.full(len(recording.inertial[SENSORS[0]].time), 1 / (_BENCH * np.sqrt(rate)))


def relative_error(
    trial: RigTrial, relative: Float[np.ndarray, "t 4"], *, lost: bool = False
) -> float:
    """RMS angle between estimated and reference R_first_second [deg], where it is known.

    Args:
        trial: with the reference.
        relative: estimated quaternions (wxyz) from the second to the first sensor's frame.
        lost: count the samples where the optical reference jumps as well.
    """
    scored = np.isfinite(trial.reference).all((1, 2)) if lost else trial.known
    first, second = trial.reference[scored, 0], trial.reference[scored, 1]
    reference = so3.quat_multiply(so3.quat_conjugate(first), second)
    error = so3.quat_multiply(so3.quat_conjugate(reference), np.asarray(relative)[scored])
    angle = np.linalg.norm(np.asarray(so3.quat_log(error)), axis=-1)
    return float(np.rad2deg(np.sqrt((angle**2).mean())))
