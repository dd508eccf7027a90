"""How sensors sit on segments, from measured orientations in a known pose.

The wearer holds a pose that is known (the model's reference pose, say). Then

    R_segment_sensor = R_world_segment(pose)^T R_world_sensor

for every sensor. Inertial sensors know the vertical but not where the body faces, so all measured
orientations may first be turned about the vertical, until an axis of one sensor points forward.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, frames, load_body
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.initialise.mounting.headings import facing_of_hinges
from mocap_jax.initialise.true_mounting import with_true_mounting
from mocap_jax.recording import InertialStream, Recording, SensorSpec

AXES = ("x", "-x", "y", "-y", "z", "-z")
RULES = ("horizontal", "opensense")
# An axis this close to the vertical tells no heading (sine of the angle between them).
_UPRIGHT = 0.1
# A time may be so far from the first or last measured orientation [s].
_NEAR = 0.05
# A facing that is off by more than this, and three deviations, is told [rad].
_FACING = np.deg2rad(35.0)


@dataclass(frozen=True)
class Heading:
    """Which axis of which sensor points to where the body faces in the calibration pose."""

    sensor: str
    axis: str
    """`x`, `-x`, `y`, `-y`, `z` or `-z`."""
    rule: Literal["horizontal", "opensense"] = "horizontal"
    """`horizontal`: the angle between the horizontal parts. `opensense`: the angle between the
    directions in space, as OpenSim computes it, which is larger where the axis is not level."""


@dataclass(frozen=True)
class PoseCalibration:
    """Sensors placed on a body."""

    recording: Recording
    """Orientations turned by the heading; its set-up names the sites."""
    body: Body
    """With a site for each sensor."""
    R_segment_sensor: dict[str, Float[np.ndarray, "3 3"]]
    heading: float
    """Turn of all measured orientations about the vertical [rad]."""


def calibrate_to_pose(
    recording: Recording,
    body: Body,
    segments: Mapping[str, str],
    *,
    pose: Float[np.ndarray, "nq"] | None = None,
    time: float | None = None,
    heading: Heading | None = None,
    positions: Mapping[str, tuple[float, float, float]] | None = None,
) -> PoseCalibration:
    """Place sensors on segments by their orientations at a time when the pose is known.

    Args:
        recording: with measured orientations; sensors that `segments` does not name are left out.
        body: unmounted, or with sites of these names, which are turned.
        segments: segment of each sensor.
        pose: q at that time; default the body's reference pose. Its root decides where the body
            faces in the world.
        time: when [s], within the recording; default each sensor's first measured orientation.
        heading: turn all orientations about the vertical first; default not at all.
        positions: of sensors on their segments [m]; default the segment's centre of mass (or where
            the site is). Orientations do not depend on it; accelerations do.

    Warns:
        UserWarning: knees or elbows bend about axes that this heading has elsewhere. Joint angles
            would be wrong by that (`calibrate_mounting` finds headings itself, and tells the
            misfit of each sensor).

    Raises:
        InputError: an unknown sensor, segment or axis, a time outside the recording, or nothing
            measured.
    """
    _check(recording, body, segments, heading)
    _check_time(recording, segments, time)
    q = np.asarray(body.qpos0 if pose is None else pose)
    if q.shape != (body.nq,):
        raise InputError(f"pose must be {body.nq} numbers, as q of this body, not {q.shape}")
    R_world_segment = np.asarray(frames(body, q).rotation)
    measured = {s: _orientation_at(recording.inertial[s], s, time) for s in segments}
    turn = 0.0
    if heading is not None:
        root = body.topology.body_parent.index(0, 1)
        turn = turn_to_forward(measured[heading.sensor], R_world_segment[root], heading)
    R_turn = Rotation.from_euler("z", turn)
    R_segment_sensor = {
        s: R_world_segment[body.topology.body_index(b)].T @ (R_turn * measured[s]).as_matrix()
        for s, b in segments.items()
    }
    streams = {s: turned_stream(recording.inertial[s], R_turn) for s in segments}
    mounted = with_sites(body, segments, R_segment_sensor, positions or {})
    setup = dataclasses.replace(
        recording.setup, sensors=specs_on_sites(recording, segments),
        provenance=recording.setup.provenance | {"mounting": "calibrated to a pose"},
    )  # fmt: skip
    _warn_of_facing(streams, body, segments, q, time, heading)
    truth = with_true_mounting(recording.truth, mounted, dict.fromkeys(segments, turn))
    turned = dataclasses.replace(
        recording, inertial=streams, setup=setup, body_xml=mounted.xml, truth=truth
    )
    return PoseCalibration(turned, mounted, R_segment_sensor, turn)


def _check(
    recording: Recording, body: Body, segments: Mapping[str, str], heading: Heading | None
) -> None:
    for sensor, segment in segments.items():
        if sensor not in recording.inertial:
            raise unknown_name("segments: sensor", sensor, tuple(recording.inertial))
        if segment not in body.topology.body_names[1:]:
            raise unknown_name(
                f"segment of sensor '{sensor}':", segment, body.topology.body_names[1:]
            )
    if heading is not None:
        check_heading(heading, segments, "heading")


def check_heading(heading: Heading, sensors: Iterable[str], argument: str) -> None:
    """Refuse a sensor that is not there, an unknown axis and an unknown rule.

    Args:
        heading: what was given.
        sensors: that there are.
        argument: what to call it in the error.
    """
    for what, given, valid in (
        ("sensor", heading.sensor, tuple(sensors)), ("axis", heading.axis, AXES),
        ("rule", heading.rule, RULES),
    ):  # fmt: skip
        if given not in valid:
            raise unknown_name(f"{argument}: {what}", given, valid)


def _check_time(recording: Recording, segments: Mapping[str, str], time: float | None) -> None:
    if time is None:
        return
    for sensor in segments:
        times = np.asarray(recording.inertial[sensor].time)
        known = times[np.isfinite(np.asarray(recording.inertial[sensor].orientation)).all(axis=1)]
        if len(known) and not known[0] - _NEAR <= time <= known[-1] + _NEAR:
            raise InputError(
                f"time {time:g} s: sensor '{sensor}' measures orientations from {known[0]:g} to "
                f"{known[-1]:g} s; valid: a time in between"
            )


def _warn_of_facing(
    streams: Mapping[str, InertialStream], body: Body, segments: Mapping[str, str], q: np.ndarray,
    time: float | None, heading: Heading | None,
) -> None:  # fmt: skip
    """Where hinges that bend say that the body faces elsewhere, say so."""
    known = [
        np.asarray(s.time)[np.isfinite(np.asarray(s.orientation)).all(axis=1)]
        for s in streams.values()
    ]
    at = max(t[0] for t in known) if time is None else time
    found = facing_of_hinges(streams, body, segments, q, at)
    if found is None or abs(found.angle) < max(_FACING, 3 * found.std):
        return
    said = "without a heading" if heading is None else f"with heading {heading}"
    warnings.warn(
        f"calibrate_to_pose: {found.source} are {np.rad2deg(abs(found.angle)):.0f} +- "
        f"{np.rad2deg(found.std):.0f} deg about the vertical from where the body has them "
        f"{said}: joint angles will be wrong by that; see calibrate_mounting",
        UserWarning, stacklevel=3,
    )  # fmt: skip


def _orientation_at(stream: InertialStream, sensor: str, time: float | None) -> Rotation:
    """`R_world_sensor` at the measured sample nearest to a time."""
    quat, times = np.asarray(stream.orientation), np.asarray(stream.time)
    known = np.flatnonzero(np.isfinite(quat).all(axis=1))
    if not len(known):
        raise InputError(f"sensor '{sensor}' has no measured orientation")
    at = known[0] if time is None else known[np.abs(times[known] - time).argmin()]
    return Rotation.from_quat(quat[at], scalar_first=True)


def turn_to_forward(R_world_sensor: Rotation, R_world_root: np.ndarray, heading: Heading) -> float:
    """Turn about the vertical that brings the sensor's axis to the root's x axis [rad]."""
    sign = -1.0 if heading.axis.startswith("-") else 1.0
    axis = sign * R_world_sensor.as_matrix()[:, "xyz".index(heading.axis[-1])]
    forward = R_world_root[:, 0]
    for name, v in ((f"axis {heading.axis} of '{heading.sensor}'", axis), ("the body", forward)):
        if np.hypot(v[0], v[1]) < _UPRIGHT:
            raise InputError(f"heading: {name} points up or down and tells no heading")
    turn = np.arctan2(
        axis[0] * forward[1] - axis[1] * forward[0], axis[0] * forward[0] + axis[1] * forward[1]
    )
    if heading.rule == "opensense":
        return float(np.copysign(np.arccos(np.clip(axis @ forward, -1.0, 1.0)), turn))
    return float(turn)


def turned_stream(stream: InertialStream, R_turn: Rotation) -> InertialStream:
    """The stream with its orientations turned in the world."""
    quat = np.array(stream.orientation)
    known = np.isfinite(quat).all(axis=1)
    if known.any():
        turned = R_turn * Rotation.from_quat(quat[known], scalar_first=True)
        quat[known] = turned.as_quat(scalar_first=True)
    return dataclasses.replace(stream, orientation=quat)


def specs_on_sites(recording: Recording, segments: Mapping[str, str]) -> tuple[SensorSpec, ...]:
    """One a sensor, on the site of its own name."""
    given = {s.name: s for s in recording.setup.sensors}
    specs = []
    for sensor in segments:
        times = np.asarray(recording.inertial[sensor].time)
        rate = 1.0 / float(np.median(np.diff(times))) if len(times) > 1 else 100.0
        spec = given.get(sensor, SensorSpec(sensor, sensor, rate))
        specs.append(dataclasses.replace(spec, site=sensor))
    return tuple(specs)


def with_sites(
    body: Body, segments: Mapping[str, str], R_segment_sensor: Mapping[str, np.ndarray],
    positions: Mapping[str, tuple[float, float, float]],
) -> Body:  # fmt: skip
    """The body with a site of each sensor's name; the MJCF text itself is edited."""
    tree = ElementTree.fromstring(body.xml)
    elements = {e.get("name", ""): e for e in tree.iter("body")}
    sites = {s.get("name", ""): (b, s) for b in tree.iter("body") for s in b.findall("site")}
    centres = body.mujoco_model().body_ipos
    for sensor, segment in segments.items():
        position = np.asarray(centres[body.topology.body_index(segment)])
        if sensor in sites:
            parent, old = sites[sensor]
            i = body.topology.site_index(sensor)
            if parent is elements.get(segment):
                position = np.asarray(body.site_pos)[i]
            parent.remove(old)
        position = np.asarray(positions.get(sensor, position), float)
        quat = Rotation.from_matrix(R_segment_sensor[sensor]).as_quat(scalar_first=True)
        if segment not in elements:
            raise InputError(f"segment '{segment}' has no name in the model's text")
        ElementTree.SubElement(
            elements[segment], "site", name=sensor, pos=numbers(position), quat=numbers(quat)
        )
    return load_body(ElementTree.tostring(tree, encoding="unicode"))
