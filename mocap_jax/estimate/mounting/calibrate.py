"""`calibrate_mounting`: a rest pose for the tilt of each sensor, motion for the headings."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, frames, load_body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.inputs import body_of
from mocap_jax.estimate.mounting.doubts import with_doubts
from mocap_jax.estimate.mounting.misfit import pose_at_rest, sensor_misfits
from mocap_jax.estimate.mounting.result import MountingCalibration, SensorMounting
from mocap_jax.initialise import Heading, declared_pose, with_orientations
from mocap_jax.initialise.mounting import (
    Facing,
    Headings,
    find_headings,
    rest_interval,
    worn_segments,
)
from mocap_jax.initialise.mounting.limb_turns import believed
from mocap_jax.initialise.orientation_calibration import (
    AXES,
    check_heading,
    specs_on_sites,
    turn_to_forward,
    turned_stream,
    with_sites,
)
from mocap_jax.initialise.true_mounting import with_true_mounting
from mocap_jax.recording import Recording, RestHold

HEADINGS = ("auto", "own", "common")
# How well people take a pose that is said to them (section 5.4 of Vlasic 2007: 3 degrees) [rad].
_POSE = 0.05
# Error of an axis of a sensor that somebody says points forward [rad].
_SAID = 0.1


def calibrate_mounting(
    recording: Recording,
    body: Body | None = None,
    segments: Mapping[str, str] | None = None,
    *,
    pose: Float[np.ndarray, "nq"] | None = None,
    time: float | None = None,
    headings: Literal["auto", "own", "common"] = "auto",
    facing: Heading | None = None,
    positions: Mapping[str, tuple[float, float, float]] | None = None,
    misfits: bool = True,
) -> MountingCalibration:
    """Find how sensors sit on their segments, and their headings, from a still second and motion.

    In the still second the pose is known, so gravity tells how each sensor is tilted on its
    segment. What it does not tell, turns about the vertical, comes from motion: neighbouring
    sensors feel the acceleration of the joint between them, and knees and elbows bend about known
    axes. Orientations are estimated (VQF) where sensors measure none.

    Args:
        recording: a still second and some walking or turning, in any order.
        body: unmounted or with sites; default the recording's own.
        segments: of each sensor; default as recording and body say (see `worn_segments`).
        pose: q at rest; default the declared one, else the body's reference pose. The body faces
            where its root faces in it.
        time: a moment of the still second [s]; default the declared rest hold, or the stillest
            second near the start.
        headings: `own`: each sensor's heading starts anywhere (no magnetometer); `common`: all
            have one; `auto`: as the recording says, else common.
        facing: which axis of which sensor points to where the body faces; default as the axes of
            knees and elbows say.
        positions: of sensors on their segments [m]; default where their sites are, or the centre
            of mass.
        misfits: fit the body to the orientations of the motion and tell what is left per sensor.

    Raises:
        InputError: an unknown sensor, segment or option, no still second, or nothing says where
            the body faces.
    """
    body = body_of(recording, body)
    worn = worn_segments(recording, body, segments)
    _check(worn, headings, facing)
    measured = _only(recording, worn)
    rest = rest_interval(measured, time)
    measured = with_orientations(measured)
    q = np.asarray(declared_pose(recording.setup.rest, body) if pose is None else pose)
    if q.shape != (body.nq,):
        raise InputError(f"pose must be {body.nq} numbers, as q of this body, not {q.shape}")
    own = headings == "own" or (headings == "auto" and _says_own(measured))
    found = find_headings(measured, body, worn, q, rest, own=own)
    chosen, remarks = _facing(found, body, worn, q, facing)
    sensors = _sensors(found, chosen, body, worn, q)
    result = _placed(measured, body, sensors, found, chosen, rest, positions or {})
    result = dataclasses.replace(result, remarks=(*found.remarks, *remarks))
    result = pose_at_rest(result, q)
    if misfits:
        result = sensor_misfits(result)
    return with_doubts(_declared(result))


def _check(worn: Mapping[str, str], headings: str, facing: Heading | None) -> None:
    if headings not in HEADINGS:
        raise unknown_name("headings:", headings, HEADINGS)
    if facing is not None:
        check_heading(facing, worn, "facing")


def _only(recording: Recording, worn: Mapping[str, str]) -> Recording:
    """Without the other sensors, and without a measured root: it is in a world of its own."""
    streams = {s: recording.inertial[s] for s in worn}
    return dataclasses.replace(recording, inertial=streams, root=None)


def _says_own(recording: Recording) -> bool:
    return "each sensor its own" in str(recording.setup.provenance.get("heading", ""))


def _facing(
    found: Headings, body: Body, worn: Mapping[str, str], q: np.ndarray, said: Heading | None
) -> tuple[Facing, tuple[str, ...]]:
    """Where the body faces: as said, or as hinges show; and what to say of it."""
    if said is None:
        if found.facing is None:
            sensors = ", ".join(worn)
            raise InputError(
                "nothing tells where the body faces: no knee or elbow with a sensor above and "
                "below bends enough; say which axis of which sensor points forward at rest, "
                f"sensors: {sensors}; axes: {', '.join(AXES)}"
            )
        return found.facing, ()
    root = body.topology.body_parent.index(0, 1)
    R_root = np.asarray(frames(body, q).rotation)[root]
    own = Rotation.from_matrix(found.R_rest[said.sensor])
    chosen = Facing(
        turn_to_forward(own, R_root, said), _SAID, f"axis {said.axis} of {said.sensor} forward"
    )
    if found.facing is None:
        return chosen, ()
    apart = float(np.angle(np.exp(1j * (chosen.angle - found.facing.angle))))
    if abs(apart) < max(3 * found.facing.std, np.deg2rad(30)):
        return chosen, ()
    text = (
        f"Facing as said (axis {said.axis} of {said.sensor}) and as the {found.facing.source} "
        f"show it are {np.rad2deg(abs(apart)):.0f} deg apart: one of them is wrong, and joint "
        "angles with it."
    )
    return chosen, (text,)


def _sensors(
    found: Headings, facing: Facing, body: Body, worn: Mapping[str, str], q: np.ndarray
) -> tuple[SensorMounting, ...]:
    """Mounting of each sensor in the pose, its limb turned as its hinge shows."""
    rotation = np.asarray(frames(body, q).rotation)
    turns = _own_turns(found, facing)
    topology, out = body.topology, []
    for sensor, segment in worn.items():
        limb, std = turns.get(sensor, (0.0, found.std[sensor]))
        if sensor not in turns:
            std = float(np.hypot(std, facing.std))
        R_segment = _about_up(limb) @ rotation[topology.body_index(segment)]
        R = R_segment.T @ _about_up(facing.angle) @ found.R_rest[sensor]
        nominal = np.eye(3)
        if sensor in topology.site_names:
            quat = np.asarray(body.site_quat)[topology.site_index(sensor)]
            nominal = Rotation.from_quat(quat, scalar_first=True).as_matrix()
        turn = Rotation.from_matrix(nominal.T @ R).magnitude()
        out.append(
            SensorMounting(
                sensor, segment, R, float(turn), _POSE, found.heading[sensor] + facing.angle,
                std, limb, found.above[sensor], found.joints.get(sensor),
            )
        )  # fmt: skip
    return tuple(out)


def _own_turns(found: Headings, facing: Facing) -> dict[str, tuple[float, float]]:
    """Turn of each limb's sensors and its deviation, hinges nearer the hand or foot first."""
    out: dict[str, tuple[float, float]] = {}
    for limb in found.limbs:
        own = believed(limb, facing)
        if own is None:
            continue
        for sensor in found.from_here(limb.sensor):
            out.setdefault(sensor, (own, float(np.hypot(limb.std, _POSE))))
    return out


def _placed(
    recording: Recording, body: Body, sensors: tuple[SensorMounting, ...], found: Headings,
    facing: Facing, rest: tuple[float, float], positions: Mapping[str, tuple[float, float, float]],
) -> MountingCalibration:  # fmt: skip
    """The recording with turned orientations, and the body with the sites."""
    segments = {s.sensor: s.segment for s in sensors}
    streams = {
        s.sensor: turned_stream(
            recording.inertial[s.sensor], Rotation.from_euler("z", s.heading)
        )
        for s in sensors
    }  # fmt: skip
    R = {s.sensor: s.R_segment_sensor for s in sensors}
    carrier = with_sites(body, segments, R, positions)
    setup = dataclasses.replace(recording.setup, sensors=specs_on_sites(recording, segments))
    truth = with_true_mounting(recording.truth, carrier, {s.sensor: s.heading for s in sensors})
    turned = dataclasses.replace(
        recording, inertial=streams, setup=setup, body_xml=carrier.xml, truth=truth
    )
    return MountingCalibration(
        turned, load_body(carrier.xml), sensors, rest, np.asarray(body.qpos0), facing, found.limbs
    )


def _declared(result: MountingCalibration) -> MountingCalibration:
    """The rest hold and where the mounting is from stand in the recording's set-up."""
    hold = RestHold(*result.rest, result.body.topology.by_joint(result.pose))
    setup = result.recording.setup
    facts = setup.provenance | {
        "mounting": f"calibrated at rest, {result.rest[0]:.2f} to {result.rest[1]:.2f} s, and "
        "from motion",
        "heading": f"one for all sensors: {result.facing.source}",
    }
    setup = dataclasses.replace(setup, rest=hold, provenance=facts)
    return dataclasses.replace(result, recording=dataclasses.replace(result.recording, setup=setup))


def _about_up(angle: float) -> np.ndarray:
    return Rotation.from_euler("z", angle).as_matrix()
