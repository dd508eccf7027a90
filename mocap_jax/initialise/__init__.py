"""First guesses: where the body is before it moves."""

from mocap_jax.initialise.check_readings import check_readings
from mocap_jax.initialise.check_sensors import SensorCheck, check_sensors
from mocap_jax.initialise.declared_pose import declared_pose
from mocap_jax.initialise.joint import (
    JointFinding,
    JointOptions,
    find_joint,
    joint_recording,
)
from mocap_jax.initialise.orientation_calibration import (
    Heading,
    PoseCalibration,
    calibrate_to_pose,
)
from mocap_jax.initialise.orientations import with_orientations
from mocap_jax.initialise.rest_options import RestOptions
from mocap_jax.initialise.rest_pose import RestEstimate, declared_rest, rest_pose
from mocap_jax.initialise.still import Still, find_still
from mocap_jax.initialise.worn_in_rest_pose import worn_in_rest_pose

__all__ = [
    "Heading",
    "JointFinding",
    "JointOptions",
    "PoseCalibration",
    "RestEstimate",
    "RestOptions",
    "SensorCheck",
    "Still",
    "calibrate_to_pose",
    "check_readings",
    "check_sensors",
    "declared_pose",
    "declared_rest",
    "find_joint",
    "find_still",
    "joint_recording",
    "rest_pose",
    "with_orientations",
    "worn_in_rest_pose",
]
