"""Checks that turn a wrong recording into one clear sentence before anything is estimated."""

from __future__ import annotations

from math import ceil, floor

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.body.topology import QPOS_WIDTH
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.recording import (
    InertialStream,
    MagneticStream,
    RangeStream,
    Recording,
    RestHold,
    RootStream,
    frame_extent,
    in_gap,
    root_speed,
)

# Farther than any room that ultrasonic sources fill [m].
_MAX_DISTANCE = 20.0
# No body segment turns faster, and ordinary motion in deg/s exceeds it [rad/s].
_MAX_RATE = 60.0
# Between 1 (readings in g) and 9.81 (in m/s^2), far from both [m/s^2].
_MIN_GRAVITY, _MAX_GRAVITY = 4.0, 100.0
# The Earth's field is 25 to 65 microtesla [T].
_MAX_FIELD = 1e-2
# Of sound: nothing on the ground is as fast, and who walks is in millimetres [m/s].
_MAX_SPEED = 340.0
_QUATERNION_TOLERANCE = 1e-3


def validate_recording(
    recording: Recording,
    body: Body | None = None,
    name: str = "recording",
    body_name: str = "the given body",
) -> None:
    """Check that a recording can be estimated from.

    Args:
        recording: what to check.
        body: the body whose sites carry the sensors; default the recording's own.
        name: what to call the recording in error messages, usually its file.
        body_name: what to call a body that is given, usually its file.

    Raises:
        InputError: no body, no measurements, an empty stream, stamps that are not finite or go
            backwards, fewer than four frames or a pause of too many, wrong units, quaternions that
            are not unit, distances or confidences out of range, a rest hold outside the recording
            or in a gap, sensors, sources, receivers or joints that the body does not have (the
            valid ones are listed).
    """
    at_fault = f"{name}: body.xml" if body is None else body_name
    body = body or _own_body(recording, name)
    if not recording.inertial and (recording.ranges is None or not len(recording.ranges.time)):
        raise InputError(f"{name}: neither inertial nor range measurements")
    has_gravity = float(np.linalg.norm(np.asarray(body.gravity))) > 1.0
    for sensor, stream in recording.inertial.items():
        _check_inertial(f"{name}: /inertial/{sensor}", stream, has_gravity)
    for sensor, field in recording.magnetic.items():
        _check_magnetic(f"{name}: /magnetic/{sensor}", field)
    if recording.root is not None:
        _check_root(f"{name}: /root", recording.root)
    if recording.ranges is not None:
        _check_ranges(f"{name}: /range", recording.ranges)
    _check_extent(recording, name)
    _check_sites(recording, body, at_fault)
    _check_rest(recording, body, name)


def validate_stream(stream: InertialStream, name: str) -> None:
    """Check one sensor's stream that was measured under the earth's gravity.

    Raises:
        InputError: stamps or shapes that are wrong, units that cannot be.
    """
    _check_inertial(name, stream, has_gravity=True)


def _own_body(recording: Recording, name: str) -> Body:
    if recording.body_xml is None:
        raise InputError(
            f"{name}: no body model (attachment body.xml is absent): give one (--body, or the "
            "argument body)"
        )
    try:
        return load_body(recording.body_xml)
    except InputError as error:
        raise InputError(f"{name}: body.xml: {error}") from error


def _check_extent(recording: Recording, name: str) -> None:
    try:
        frame_extent(recording)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def _check_time(where: str, time: np.ndarray, *, repeats: bool = False) -> None:
    if time.ndim != 1:
        raise InputError(f"{where}: time has shape {time.shape}, expected (n,)")
    if not len(time):
        raise InputError(f"{where}: the stream is empty")
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise InputError(f"{where}: {bad.size} time stamps are not finite (first: sample {bad[0]})")
    step = np.diff(time)
    bad = np.flatnonzero(step < 0 if repeats else step <= 0)
    if bad.size:
        i = int(bad[0])
        what = "goes backwards" if step[i] < 0 else "repeats"
        raise InputError(
            f"{where}: time {what} at sample {i + 1} ({time[i]:.6f} s, then {time[i + 1]:.6f} s; "
            f"{bad.size} such places)"
        )


def _check_shape(where: str, what: str, values: np.ndarray, n: int, width: int) -> None:
    if values.shape != (n, width):
        raise InputError(f"{where}: {what} has shape {values.shape}, expected ({n}, {width})")
    if np.isinf(values).any():
        raise InputError(f"{where}: {what} has infinite values (missing ones must be NaN)")


def _check_unit(where: str, quaternion: np.ndarray) -> None:
    norm = np.linalg.norm(quaternion, axis=-1)
    bad = np.flatnonzero(np.abs(norm - 1.0) > _QUATERNION_TOLERANCE)
    if bad.size:
        raise InputError(
            f"{where}: orientation {bad[0]} is not a unit quaternion (norm {norm[bad[0]]:.4g}; "
            f"{bad.size} of {len(norm)})"
        )


def _median_norm(values: np.ndarray) -> float:
    norm = np.linalg.norm(values, axis=1)
    norm = norm[np.isfinite(norm)]
    return float(np.median(norm)) if norm.size else np.nan


def _check_inertial(where: str, stream: InertialStream, has_gravity: bool) -> None:
    time = np.asarray(stream.time)
    _check_time(where, time)
    accelerometer, gyroscope = np.asarray(stream.accelerometer), np.asarray(stream.gyroscope)
    _check_shape(where, "accelerometer", accelerometer, len(time), 3)
    _check_shape(where, "gyroscope", gyroscope, len(time), 3)
    _check_shape(where, "orientation", np.asarray(stream.orientation), len(time), 4)
    _check_unit(where, np.asarray(stream.orientation))
    norm = _median_norm(accelerometer)
    if has_gravity and (norm < _MIN_GRAVITY or norm > _MAX_GRAVITY):
        guess = "the unit is probably g" if 0.7 < norm < 1.5 else "check unit and gravity"
        raise InputError(
            f"{where}: median accelerometer norm {norm:.3g}: {guess}; expected m/s^2 with gravity "
            "included (about 9.81 at rest)"
        )
    rate = np.linalg.norm(gyroscope, axis=1)
    rate = rate[np.isfinite(rate)]
    if rate.size and (high := float(np.percentile(rate, 99))) > _MAX_RATE:
        raise InputError(
            f"{where}: angular velocities reach {high:.4g}: the unit is probably deg/s; expected "
            f"rad/s (less than {_MAX_RATE:g})"
        )


def _check_magnetic(where: str, stream: MagneticStream) -> None:
    time, field = np.asarray(stream.time), np.asarray(stream.field)
    _check_time(where, time)
    _check_shape(where, "field", field, len(time), 3)
    if (norm := _median_norm(field)) > _MAX_FIELD:
        raise InputError(
            f"{where}: median magnetic field {norm:.3g}: the unit is probably microtesla or gauss; "
            "expected tesla (about 5e-5)"
        )


def _check_root(where: str, root: RootStream) -> None:
    time = np.asarray(root.time)
    _check_time(where, time)
    _check_shape(where, "position", np.asarray(root.position), len(time), 3)
    _check_shape(where, "orientation", np.asarray(root.orientation), len(time), 4)
    _check_unit(where, np.asarray(root.orientation))
    if np.nanmax(np.abs(np.asarray(root.position)), initial=0.0) > 1e4:
        raise InputError(f"{where}: positions exceed 10 km: expected metres")
    if (usual := root_speed(root)) > _MAX_SPEED:
        raise InputError(
            f"{where}: positions move at {usual:.4g} m/s in the median over seconds: probably "
            "millimetres; expected metres"
        )


def _check_ranges(where: str, ranges: RangeStream) -> None:
    time, distance = np.asarray(ranges.time), np.asarray(ranges.distance)
    confidence = np.asarray(ranges.confidence)
    if not len(time):
        return
    _check_time(where, time, repeats=True)
    for what, values, names in (
        ("source", np.asarray(ranges.source), ranges.source_names),
        ("receiver", np.asarray(ranges.receiver), ranges.receiver_names),
    ):
        if values.shape != time.shape or values.min() < 0 or values.max() >= len(names):
            raise InputError(f"{where}: {what} indices must be {len(time)} numbers below "
                             f"{len(names)}, the number of {what} names")  # fmt: skip
    if distance.shape != time.shape or confidence.shape != time.shape:
        raise InputError(f"{where}: distance and confidence must have one value per time stamp")
    if np.nanmin(distance, initial=0.0) < 0:
        raise InputError(f"{where}: negative distances (lowest {np.nanmin(distance):.4g} m)")
    if (high := float(np.nanmax(distance, initial=0.0))) > _MAX_DISTANCE:
        raise InputError(
            f"{where}: distances up to {high:.4g}: probably millimetres; expected metres (at most "
            f"{_MAX_DISTANCE:g})"
        )
    if not ((confidence >= 0) & (confidence <= 1)).all():
        raise InputError(
            f"{where}: confidences from {confidence.min():.4g} to {confidence.max():.4g}; expected "
            "0 to 1"
        )


def _check_sites(recording: Recording, body: Body, body_name: str) -> None:
    valid = body.topology.site_names
    site_of = {s.name: s.site for s in recording.setup.sensors}
    carriers = [("sensor", s) for s in recording.inertial]
    if (ranges := recording.ranges) is not None and len(ranges.time):
        used = np.unique(np.asarray(ranges.source)), np.unique(np.asarray(ranges.receiver))
        carriers += [("range source", ranges.source_names[i]) for i in used[0]]
        carriers += [("range receiver", ranges.receiver_names[i]) for i in used[1]]
    for what, carrier in carriers:
        site = site_of.get(carrier, carrier)
        if site not in valid:
            if not valid:
                raise InputError(
                    f"{body_name}: the body has no sites to carry the sensors; it needs one named "
                    f"'{site}' for {what} '{carrier}', and so on"
                )
            raise InputError(
                f"{body_name}: no place for {what} '{carrier}': {unknown_name('site', site, valid)}"
            )


def _check_rest(recording: Recording, body: Body, name: str) -> None:
    rest = recording.setup.rest
    if rest is None:
        return
    _check_hold(recording, rest, name)
    topology = body.topology
    for joint, values in rest.pose.items():
        if joint not in topology.joint_names:
            error = unknown_name("joint", joint, topology.joint_names)
            raise InputError(f"{name}: rest pose: {error}")
        kind = topology.joint_types[topology.joint_names.index(joint)]
        if len(values) != QPOS_WIDTH[kind]:
            raise InputError(
                f"{name}: rest pose of {kind} joint '{joint}' has {len(values)} numbers, expected "
                f"{QPOS_WIDTH[kind]}"
            )


def _check_hold(recording: Recording, rest: RestHold, name: str) -> None:
    first, last = recording.interval
    # Samples are stamped at the centres of their intervals: a frame beyond them is still measured.
    frame = 1.0 / frame_extent(recording).rate_hz
    if rest.start <= last + frame and rest.end >= first - frame:
        if in_gap(recording, rest.start, rest.end):
            raise InputError(f"{name}: {_unmeasured(recording, rest)}")
        return
    way = f"--from {floor(1e2 * first) / 1e2:.2f}"
    if rest.start > last:
        way = f"--to {ceil(1e2 * last) / 1e2:.2f}"
    raise InputError(
        f"{name}: the declared rest hold, {rest.start:.2f} to {rest.end:.2f} s, is outside the "
        f"recording, {first:.2f} to {last:.2f} s; {way} estimates without it (in Python: mj.cut)"
    )


def _unmeasured(recording: Recording, rest: RestHold) -> str:
    """What to say of a rest hold in a gap, and which stretch has none."""
    if rest.end < recording.interval[1]:
        way = f"--from {ceil(1e2 * rest.end) / 1e2:.2f}"
    else:
        way = f"--to {floor(1e2 * rest.start) / 1e2:.2f}"
    return (
        f"the declared rest hold, {rest.start:.2f} to {rest.end:.2f} s, lies in a gap: nothing was "
        f"measured then, or hardly anything; {way} estimates without it (in Python: mj.cut)"
    )
