"""The two-segment rig through the whole-sequence optimiser: options, and the error measure."""

from __future__ import annotations

import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body
from mocap_jax.estimate.sequence.layout import UserResidual
from mocap_jax.estimate.whole_sequence import optimise
from mocap_jax.estimate.whole_sequence_options import (
    ConstantsOptions,
    NoiseOptions,
    OptimiseOptions,
    PriorOptions,
)
from mocap_jax.io.two_segment_rig import RigTrial
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
    rate = trial.recording.setup.sensors[0].rate_hz
    whitening = np.full(len(trial.known), 1 / (_BENCH * np.sqrt(rate)))
    return optimise(trial.recording, trial.body, options=options, user_data=(whitening,))


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
