"""Headings of all sensors from the joints between them, and where hinges lie at rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.initialise.mounting.hinge_axis import HingeAxis, bending_hinge, hinge_axis
from mocap_jax.initialise.mounting.joint_heading import (
    JointHeading,
    WorldMotion,
    even_grid,
    joint_heading,
    turning,
    world_motion,
)
from mocap_jax.initialise.mounting.limb_turns import (
    Facing,
    LimbTurn,
    limb_turns,
    where_it_faces,
)
from mocap_jax.initialise.mounting.worn import sensors_above
from mocap_jax.initialise.still import within
from mocap_jax.recording import InertialStream, Recording

# Half of the interval that stands for a moment [s].
_STILL = 0.1


@dataclass(frozen=True)
class Headings:
    """What motion says; one world for all sensors, whose x axis is still anywhere."""

    above: dict[str, str | None]
    heading: dict[str, float]
    """Turn of each sensor's orientations into that world [rad]."""
    std: dict[str, float]
    """Relative to the topmost sensor [rad]."""
    joints: dict[str, JointHeading]
    """By the sensor below."""
    R_rest: dict[str, np.ndarray]
    """`R_world_sensor` at rest, in that world."""
    limbs: tuple[LimbTurn, ...]
    facing: Facing | None
    remarks: tuple[str, ...]

    def from_here(self, sensor: str) -> list[str]:
        """The sensor and all below it."""
        return [s for s in self.above if s == sensor or self._is_below(s, sensor)]

    def _is_below(self, sensor: str, top: str) -> bool:
        up = self.above[sensor]
        return up is not None and (up == top or self._is_below(up, top))


def find_headings(
    recording: Recording, body: Body, worn: Mapping[str, str], pose: np.ndarray,
    rest: tuple[float, float], *, own: bool,
) -> Headings:  # fmt: skip
    """Headings along the tree of sensors, then the hinges in the world that they make.

    Args:
        recording: with orientations.
        body: that wears the sensors.
        worn: segment of each sensor.
        pose: q at rest.
        rest: still interval [s].
        own: each sensor has a heading of its own; otherwise all are taken to be one, and what
            joints say is kept to compare.
    """
    above = sensors_above(worn, body)
    grid = even_grid(list(recording.inertial.values()))
    motions = {s: world_motion(recording.inertial[s], grid) for s in worn}
    joints = _joints(above, motions)
    heading, std, unknown = _along_tree(above, joints, own=own)
    R_rest = {
        s: _about_up(heading[s]) @ _at_rest(s, recording.inertial[s], rest) for s in worn
    }  # fmt: skip
    still = (grid >= rest[0]) & (grid <= rest[1])
    hinges = _hinges(body, worn, above, motions, heading, pose, still)
    limbs = limb_turns(body, pose, worn, hinges, R_rest, std)
    remarks: tuple[str, ...] = ()
    if unknown:
        remarks = (
            f"Heading of {', '.join(unknown)} is not known: the joint towards the trunk is hardly "
            "accelerated; walking or turning would tell it.",
        )
    return Headings(
        above, heading, std, joints, R_rest, limbs, where_it_faces(limbs, worn), remarks
    )


def facing_of_hinges(
    streams: Mapping[str, InertialStream], body: Body, worn: Mapping[str, str], pose: np.ndarray,
    time: float,
) -> Facing | None:  # fmt: skip
    """Turn about the vertical that orientations of one heading lack, as hinges show it.

    None where no knee or elbow has sensors above and below, or bends.

    Args:
        streams: by sensor.
        body: that wears the sensors.
        worn: segment of each sensor.
        pose: q at that time.
        time: when the body is in the pose [s].
    """
    above = sensors_above(worn, body)
    index = body.topology.body_index
    hinged = {
        s for s, up in above.items()
        if up is not None and bending_hinge(body, index(worn[up]), index(worn[s])) is not None
    }  # fmt: skip
    needed = hinged | {up for s in hinged if (up := above[s]) is not None}
    if not needed:
        return None
    grid = even_grid([streams[s] for s in needed])
    motions = {s: turning(streams[s], grid) if s in needed else None for s in worn}
    none = dict.fromkeys(worn, 0.0)
    still = np.abs(grid - time) <= _STILL
    hinges = _hinges(body, worn, above, motions, none, pose, still)
    R_rest = {s: _nearest(streams[s], time) for pair in hinges for s in pair}
    return where_it_faces(limb_turns(body, pose, worn, hinges, R_rest, none), worn)


def _joints(
    above: Mapping[str, str | None], motions: Mapping[str, WorldMotion | None]
) -> dict[str, JointHeading]:
    out = {}
    for sensor, up in above.items():
        first, second = motions[up] if up else None, motions[sensor]
        if first is not None and second is not None:
            out[sensor] = joint_heading(first, second)
    return out


def _along_tree(
    above: Mapping[str, str | None], joints: Mapping[str, JointHeading], *, own: bool
) -> tuple[dict[str, float], dict[str, float], list[str]]:
    """Heading and deviation of each sensor from the topmost on, and those that nothing tells."""
    heading, std = dict.fromkeys(above, 0.0), dict.fromkeys(above, 0.0)
    if not own:
        return heading, std, []
    unknown = []
    for sensor, up in above.items():
        if up is None:
            continue
        joint = joints.get(sensor)
        known = joint is not None and joint.known
        angle = joint.angle if joint is not None else 0.0
        heading[sensor] = float(np.angle(np.exp(1j * (heading[up] + angle))))
        std[sensor] = float(min(np.hypot(std[up], joint.std if joint else np.pi), np.pi))
        if not known:
            unknown.append(sensor)
    return heading, std, unknown


def _hinges(
    body: Body, worn: Mapping[str, str], above: Mapping[str, str | None],
    motions: Mapping[str, WorldMotion | None], heading: Mapping[str, float], pose: np.ndarray,
    rest: np.ndarray,
) -> dict[tuple[str, str], HingeAxis]:  # fmt: skip
    out = {}
    for below, up in above.items():
        if up is None:
            continue
        first, second = motions[up], motions[below]
        index = body.topology.body_index
        joint = bending_hinge(body, index(worn[up]), index(worn[below]))
        if joint is None or first is None or second is None:
            continue
        turn, at_rest = heading[below] - heading[up], pose[body.topology.joint_qpos[joint]]
        axis = hinge_axis(body, joint, first, second, turn, rest, float(at_rest))
        if axis is not None:
            out[up, below] = axis
    return out


def _at_rest(sensor: str, stream: InertialStream, rest: tuple[float, float]) -> np.ndarray:
    """Mean `R_world_sensor` over the interval."""
    quat = np.asarray(stream.orientation, float)[within(stream, *rest)]
    quat = quat[np.isfinite(quat).all(axis=1)]
    if not len(quat):
        raise InputError(
            f"sensor '{sensor}' has no orientation at rest ({rest[0]:.2f} to {rest[1]:.2f} s)"
        )
    return Rotation.from_quat(quat, scalar_first=True).mean().as_matrix()


def _nearest(stream: InertialStream, time: float) -> np.ndarray:
    """`R_world_sensor` at the measured sample nearest to a time."""
    quat = np.asarray(stream.orientation, float)
    known = np.flatnonzero(np.isfinite(quat).all(axis=1))
    at = known[np.abs(np.asarray(stream.time)[known] - time).argmin()]
    return Rotation.from_quat(quat[at], scalar_first=True).as_matrix()


def _about_up(angle: float) -> np.ndarray:
    return Rotation.from_euler("z", angle).as_matrix()
