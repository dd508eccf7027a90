"""How sensors sit on segments and where their headings start, from motion (see `estimate`)."""

from mocap_jax.initialise.mounting.headings import Headings, find_headings
from mocap_jax.initialise.mounting.hinge_axis import HingeAxis, bending_hinge, hinge_axis
from mocap_jax.initialise.mounting.joint_heading import (
    JointHeading,
    WorldMotion,
    even_grid,
    joint_heading,
    world_motion,
)
from mocap_jax.initialise.mounting.limb_turns import Facing, LimbTurn, limb_turns, where_it_faces
from mocap_jax.initialise.mounting.still_second import NotStillError, rest_interval
from mocap_jax.initialise.mounting.worn import sensors_above, worn_segments

__all__ = [
    "Facing",
    "Headings",
    "HingeAxis",
    "JointHeading",
    "LimbTurn",
    "NotStillError",
    "WorldMotion",
    "bending_hinge",
    "even_grid",
    "find_headings",
    "hinge_axis",
    "joint_heading",
    "limb_turns",
    "rest_interval",
    "sensors_above",
    "where_it_faces",
    "world_motion",
    "worn_segments",
]
