"""Known motions: clips from files, built-in routines, and bodies that perform them."""

from mocap_jax.motion.asf import body_from_asf
from mocap_jax.motion.ball_joints import ball_jointed
from mocap_jax.motion.builtin import BUILTIN_MOTIONS, builtin_motion
from mocap_jax.motion.bvh import body_from_bvh
from mocap_jax.motion.cut import cut_motion
from mocap_jax.motion.human import human, segment_lengths, segment_tip, with_segment_lengths
from mocap_jax.motion.human_like import human_like
from mocap_jax.motion.joint_positions import load_skeleton
from mocap_jax.motion.joint_table import SUFFIXES as JOINT_SUFFIXES
from mocap_jax.motion.joint_table import holds_joints
from mocap_jax.motion.load import (
    MOTION_SUFFIXES,
    SCALED_SUFFIXES,
    SKELETON_SUFFIXES,
    load_motion,
)
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.retarget import retarget
from mocap_jax.motion.retarget_error import retarget_errors, retarget_table
from mocap_jax.motion.segment_names import XSENS_SEGMENTS, xsens_name
from mocap_jax.motion.skeleton import TIP_PREFIX
from mocap_jax.motion.together import together

__all__ = [
    "BUILTIN_MOTIONS", "JOINT_SUFFIXES", "MOTION_SUFFIXES", "SCALED_SUFFIXES",
    "SKELETON_SUFFIXES", "TIP_PREFIX", "XSENS_SEGMENTS", "Motion", "ball_jointed", "body_from_asf",
    "body_from_bvh", "builtin_motion", "cut_motion", "holds_joints", "human", "human_like",
    "load_motion", "load_skeleton", "retarget", "retarget_errors", "retarget_table",
    "segment_lengths", "segment_tip", "together", "with_segment_lengths", "xsens_name",
]  # fmt: skip
