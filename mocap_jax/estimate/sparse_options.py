"""Options for a few inertial boards that report their orientation."""

from __future__ import annotations

from mocap_jax.estimate.contact.options import ContactOptions
from mocap_jax.estimate.whole_sequence_options import NoiseOptions, OptimiseOptions, PriorOptions
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
        contacts=ContactOptions() if contacts else None,
        prior=PriorOptions(skin_sigma=0.005),
        noise=NoiseOptions(lag=0.005, lever_arm_sigma=0.005, accelerometer_model=0.05, adapt=False),
    )
