"""The built-in human body: proportions, masses, joints and shape, and its segment lengths."""

from mocap_jax.motion.human.build import check_size, human
from mocap_jax.motion.human.lengths import (
    segment_lengths,
    segment_tip,
    with_segment_lengths,
)
from mocap_jax.motion.human.proportions import SEXES, Sex

__all__ = [
    "SEXES", "Sex", "check_size", "human", "segment_lengths", "segment_tip",
    "with_segment_lengths",
]  # fmt: skip
