"""Known motions: clips from files, built-in routines, and bodies that perform them."""

from mocap_jax.motion.asf import body_from_asf
from mocap_jax.motion.builtin import BUILTIN_MOTIONS, builtin_motion
from mocap_jax.motion.bvh import body_from_bvh
from mocap_jax.motion.human import human
from mocap_jax.motion.load import load_motion
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.retarget import retarget
from mocap_jax.motion.segment_names import XSENS_SEGMENTS, xsens_name

__all__ = [
    "BUILTIN_MOTIONS", "XSENS_SEGMENTS", "Motion", "body_from_asf", "body_from_bvh",
    "builtin_motion", "human", "load_motion", "retarget", "xsens_name",
]  # fmt: skip
