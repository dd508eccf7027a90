"""OpenSim models (`.osim`): their kinematics as MJCF."""

from mocap_jax.body.opensim.cardan import CardanJoint, cardan_joints
from mocap_jax.body.opensim.mjcf import (
    MODEL,
    PIVOT_PREFIX,
    R_WORLD_GROUND,
    WELDED,
    opensim_mjcf,
)
from mocap_jax.body.opensim.pose import (
    OpensimCoordinates,
    coordinates_from_poses,
    pose_from_coordinates,
)

__all__ = [
    "MODEL", "PIVOT_PREFIX", "R_WORLD_GROUND", "WELDED", "CardanJoint", "OpensimCoordinates",
    "cardan_joints", "coordinates_from_poses", "opensim_mjcf", "pose_from_coordinates",
]  # fmt: skip
