"""What a whole-sequence solution records of its solve: options, priors, and what failed."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.estimate.constant_names import constant_places
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.levels import Levels
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions

ROUNDED_DEVIATIONS = (
    "Deviations of constants come from equations shifted by their rounding error, which holds the "
    "root's drift: they are too small by up to a tenth."
)


def prior_deviations(
    layout: Layout, sensors: tuple[str, ...], information: np.ndarray
) -> dict[str, np.ndarray]:
    """By name, from inverse variances (m,); of walks those of the steps, (n, 3)."""
    out = {k: 1 / np.sqrt(information[at]) for k, at in constant_places(layout, sensors).items()}
    walks = ("gyroscope_bias_walk", "accelerometer_bias_walk")
    return {k: v.reshape(-1, 3) if k.split("/")[0] in walks else v for k, v in out.items()}


def undetermined_remark(reason: str, root_given: bool, oriented: bool) -> str:
    """Why there is no covariance, and what is likely not determined."""
    free = "root position" if oriented else "root position, heading and their slow drift"
    what = "some poses" if root_given else free
    return f"The data do not determine {what}; no covariance ({reason})."


def option_record(options: OptimiseOptions, levels: Levels) -> dict[str, object]:
    """For `Solution.options`: all of them, and the noise levels that were found."""
    record = dataclasses.asdict(dataclasses.replace(options, user_residuals=(), pose_prior=None))
    record["pose_prior"] = options.pose_prior.name if options.pose_prior else None
    record["user_residuals"] = [r.name for r in options.user_residuals]
    record["levels"] = dataclasses.asdict(levels)
    return record
