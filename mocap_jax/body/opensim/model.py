"""What an OpenSim model says about kinematics, as plain data.

Frames as in OpenSim: Y up, X forward, metres, radians. A joint's transform takes coordinates of its
frame on the child to its frame on the parent: turn about `rotations` in their order (each axis in
the frame turned so far), shift along `translations` (axes of the parent's frame).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body.piecewise import Piecewise

GROUND = "ground"


@dataclass(frozen=True)
class Placement:
    """A frame fixed to a body: `R_body_frame` and the frame's origin in the body [m]."""

    body: str
    rotation: Rotation
    position: np.ndarray


@dataclass(frozen=True)
class OsimBody:
    """One rigid body."""

    name: str
    mass: float
    """[kg]"""
    centre: np.ndarray
    """Centre of mass [m]."""
    inertia: np.ndarray
    """xx, yy, zz, xy, xz, yz about the centre of mass [kg m^2]."""
    frames: tuple[tuple[str, Placement], ...] = ()
    """Named frames on it, such as those of sensors that OpenSense has placed."""


@dataclass(frozen=True)
class Coordinate:
    """One generalised coordinate [rad or m]."""

    name: str
    default: float
    range: tuple[float, float]
    clamped: bool
    locked: bool


@dataclass(frozen=True)
class TransformAxis:
    """Turn about, or shift along, `axis` by `function` of a coordinate; of none: by a constant."""

    name: str
    """`rotation1` ... `translation3`."""
    axis: np.ndarray
    function: Piecewise
    coordinate: str | None = None


@dataclass(frozen=True)
class OsimJoint:
    """A joint between two bodies."""

    name: str
    kind: str
    parent: Placement
    child: Placement
    coordinates: tuple[Coordinate, ...] = ()
    rotations: tuple[TransformAxis, ...] = ()
    translations: tuple[TransformAxis, ...] = ()


@dataclass(frozen=True)
class Coupler:
    """`dependent` = function(`independent`), of two coordinates (CoordinateCouplerConstraint)."""

    dependent: str
    independent: str
    function: Piecewise


@dataclass(frozen=True)
class OsimModel:
    """A whole model; joints in the file's order."""

    name: str
    gravity: np.ndarray
    """[m/s^2]"""
    bodies: dict[str, OsimBody]
    joints: tuple[OsimJoint, ...]
    couplers: tuple[Coupler, ...] = field(default=())
