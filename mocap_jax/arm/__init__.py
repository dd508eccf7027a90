"""The ultrasonic arm tracker: one mobile on the wrist, anchors in the world, two links.

The paper's system equation by equation (`wrist_filter`, `inverse_kinematics`), beside the general
estimators on the same ranges (`track`).
"""

from mocap_jax.arm.errors import ArmErrors, arm_errors, reference_angles
from mocap_jax.arm.inverse_kinematics import (
    PlanarAngles,
    SpatialArm,
    forward,
    link_transform,
    planar_angles,
    spatial_arm,
)
from mocap_jax.arm.ranges import PulseRanges, anchor_ranges, compensated
from mocap_jax.arm.track import (
    ArmTrack,
    joint_filter,
    optimised,
    paper_tracker,
)
from mocap_jax.arm.wrist_filter import WristEstimate, WristFilterOptions, wrist_filter

__all__ = [
    "ArmErrors", "ArmTrack", "PlanarAngles", "PulseRanges", "SpatialArm", "WristEstimate",
    "WristFilterOptions", "anchor_ranges", "arm_errors", "compensated", "forward", "joint_filter",
    "link_transform", "optimised", "paper_tracker", "planar_angles", "reference_angles",
    "spatial_arm", "wrist_filter",
]  # fmt: skip
