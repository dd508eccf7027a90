"""What poses people take: a Gaussian over joint rotations, learned from motion capture."""

from mocap_jax.pose_prior.default import default_pose_prior
from mocap_jax.pose_prior.file import load_pose_prior, save_pose_prior
from mocap_jax.pose_prior.learn import JOINTS, learn_pose_prior
from mocap_jax.pose_prior.limits import JointLimits, learn_joint_limits
from mocap_jax.pose_prior.prior import PosePrior
from mocap_jax.pose_prior.rotations import anatomical_joint_rotations

__all__ = [
    "JOINTS",
    "JointLimits",
    "PosePrior",
    "anatomical_joint_rotations",
    "default_pose_prior",
    "learn_joint_limits",
    "learn_pose_prior",
    "load_pose_prior",
    "save_pose_prior",
]
