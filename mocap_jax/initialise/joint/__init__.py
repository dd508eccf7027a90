"""The joint between two sensors, found from their motion."""

from mocap_jax.initialise.joint.body import joint_recording
from mocap_jax.initialise.joint.find import find_joint
from mocap_jax.initialise.joint.finding import JointFinding
from mocap_jax.initialise.joint.options import JointOptions

__all__ = ["JointFinding", "JointOptions", "find_joint", "joint_recording"]
