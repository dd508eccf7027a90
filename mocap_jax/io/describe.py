"""What is in a file, in words."""

from __future__ import annotations

import datetime
import os
from pathlib import Path

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.io.mcap_read import read_contents
from mocap_jax.io.mcap_write import METADATA_NAME
from mocap_jax.io.recording_reader import kind_of, recording_from
from mocap_jax.io.setup_toml import read_setup
from mocap_jax.io.solution_file import solution_from
from mocap_jax.motion import (
    JOINT_SUFFIXES,
    MOTION_SUFFIXES,
    body_from_asf,
    holds_joints,
    load_motion,
    load_skeleton,
)
from mocap_jax.recording import (
    InertialStream,
    RangeStream,
    Recording,
    Setup,
    doubtful_root,
    ragged_ends,
)
from mocap_jax.solution import Solution

_BODIES = (".xml", ".osim", ".asf")


def describe(path: str | os.PathLike[str]) -> str:
    """Describe a file in a few lines of text.

    Args:
        path: a recording or solution (.mcap), a motion (.amc, .bvh, .npz), a body (.xml, .osim,
            .asf; .json, .npz or .csv with the joints of a skeleton) or a set-up (.toml).

    Raises:
        InputError: the file is missing, of another kind, or wrong.
    """
    suffix = Path(path).suffix.lower()
    if Path(path).is_dir():
        raise InputError(f"{path}: this is a folder; name a file in it")
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file")
    if suffix == ".mcap":
        lines = _mcap(path)
    elif suffix in MOTION_SUFFIXES and not holds_joints(path):
        lines = _motion(path)
    elif suffix in JOINT_SUFFIXES:
        lines = ["kind: body (skeleton of joint positions)", *_body(load_skeleton(path))]
    elif suffix in _BODIES:
        body = body_from_asf(path) if suffix == ".asf" else load_body(path)
        lines = ["kind: body", *_body(body)]
    elif suffix == ".toml":
        lines = ["kind: set-up", *_setup(read_setup(path))]
    else:
        kinds = (".mcap", *MOTION_SUFFIXES, *_BODIES, *JOINT_SUFFIXES, ".toml")
        valid = ", ".join(dict.fromkeys(kinds))
        raise InputError(f"{path}: unknown kind of file '{suffix}'; valid: {valid}")
    return "\n".join([f"file: {path} ({Path(path).stat().st_size / 1e6:.2f} MB)", *lines])


def _mcap(path: str | os.PathLike[str]) -> list[str]:
    contents = read_contents(path)
    facts = contents.metadata.get(METADATA_NAME, {})
    software = f"written by: {facts.get('software', 'unknown software')}"
    if facts.get("format_version"):
        software += f", format {facts['format_version']}"
    if kind_of(contents) == "solution":
        return ["kind: solution", *_solution(solution_from(path, contents)), software]
    return ["kind: recording", *_recording(recording_from(path, contents)), software]


def _recording(recording: Recording) -> list[str]:
    start, end = recording.interval
    lines = [f"duration: {end - start:.3f} s (from {start:.3f} s to {end:.3f} s)"]
    if recording.start_utc_ns:
        whole = datetime.datetime.fromtimestamp(recording.start_utc_ns // 10**9, datetime.UTC)
        lines.append(f"start: {whole:%Y-%m-%d %H:%M:%S} UTC")
    if recording.subject:
        lines.append(f"subject: {recording.subject}")
    lines.append(f"inertial sensors: {len(recording.inertial)}")
    lines += [f"  {name}: {_inertial(s)}" for name, s in recording.inertial.items()]
    lines += [
        f"  {name}: magnetic field, {_rate(np.asarray(s.time))}"
        for name, s in recording.magnetic.items()
    ]
    lines.append("ranges: " + ("none" if recording.ranges is None else _ranges(recording.ranges)))
    if (root := recording.root) is not None:
        lines.append(f"root pose: {_rate(np.asarray(root.time))}")
    if (air := recording.temperature) is not None and len(air.time):
        celsius = np.asarray(air.celsius)
        lines.append(f"temperature: {celsius.min():.1f} to {celsius.max():.1f} degrees Celsius")
    lines.append("truth: " + _truth(recording))
    lines += _own_body(recording) + _setup(recording.setup)
    lines += [f"ends: {text}" for text in ragged_ends(recording)]
    lines += [f"root: {text}" for text in doubtful_root(recording)]
    return lines + [f"salvaged: {text}" for text in recording.salvage]


def _rate(time: np.ndarray) -> str:
    """Number of samples, rate, and samples missing from an even spacing."""
    if len(time) < 2:
        return f"{len(time)} samples"
    step = float(np.median(np.diff(time)))
    if not step > 0:
        return f"{len(time)} samples"
    missing = int(np.sum(np.maximum(np.rint(np.diff(time) / step) - 1, 0)))
    gaps = f", {missing} dropped" if missing else ""
    return f"{len(time)} samples at {1 / step:.1f} Hz{gaps}"


def _inertial(stream: InertialStream) -> str:
    parts = [_rate(np.asarray(stream.time))]
    for what in ("accelerometer", "gyroscope", "orientation"):
        bad = ~np.isfinite(np.asarray(getattr(stream, what))).all(axis=1)
        if bad.size and bad.all():
            parts.append(f"no {what}")
        elif bad.any():
            parts.append(f"{what} missing in {int(bad.sum())} ({100 * bad.mean():.1f} %)")
    return ", ".join(parts)


def _ranges(ranges: RangeStream) -> str:
    confidence = np.asarray(ranges.confidence)
    pairs = len(np.unique(np.stack([ranges.source, ranges.receiver]), axis=1).T)
    text = (
        f"{len(confidence)} distances, {len(ranges.source_names)} sources, "
        f"{len(ranges.receiver_names)} receivers, {pairs} pairs heard"
    )
    if not len(confidence):
        return text
    distance = np.asarray(ranges.distance)
    useless = 100 * float(np.mean(confidence == 0))
    if (known := distance[np.isfinite(distance)]).size:
        text += f"; {known.min():.3f} to {known.max():.3f} m"
    return f"{text}; confidence mean {confidence.mean():.2f}, zero in {useless:.1f} %"


def _truth(recording: Recording) -> str:
    if recording.truth is None:
        return "none"
    poses = _rate(np.asarray(recording.truth.trajectory.time)).replace("samples", "poses")
    count = len(recording.truth.parameters)
    return poses + (f", {count} true parameters" if count else "")


def _own_body(recording: Recording) -> list[str]:
    if recording.body_xml is None:
        return ["body: none (give one with --body)"]
    try:
        return _body(load_body(recording.body_xml))
    except InputError as error:
        return [f"body: {error}"]


def _body(body: Body) -> list[str]:
    topology = body.topology
    kinds = ", ".join(
        f"{topology.joint_types.count(kind)} {kind}"
        for kind in ("free", "ball", "hinge", "slide")
        if kind in topology.joint_types
    )
    root = topology.body_names[1] if topology.nbody > 1 else "none"
    return [
        f"body: {topology.nbody - 1} segments (root {root}), {topology.njoint} joints ({kinds}), "
        f"{body.nv} degrees of freedom, {len(topology.site_names)} sites"
    ]


def _setup(setup: Setup) -> list[str]:
    lines = [f"set-up: {len(setup.sensors)} sensors, {len(setup.sources)} sources"]
    if setup.rest is not None:
        lines[0] += f", rest hold from {setup.rest.start:g} s to {setup.rest.end:g} s"
    if setup.provenance:
        plain = {k: v for k, v in setup.provenance.items() if "/" not in k}
        facts = ", ".join(f"{key} = {value}" for key, value in plain.items())
        lines.append(f"provenance: {facts}")
        lines += _worn(setup)
    return lines


def _worn(setup: Setup) -> list[str]:
    """What converted sensors were called, and where they are worn."""
    facts = setup.provenance
    lines = []
    for sensor in setup.sensors:
        identity, segment = (facts.get(f"{key}/{sensor.name}") for key in ("sensor", "segment"))
        if identity is not None or segment is not None:
            lines.append(f"  {sensor.name}: from {identity or '?'}, on {segment or '?'}")
    return lines


def _solution(solution: Solution) -> list[str]:
    time = np.asarray(solution.trajectory.time)
    lines = [
        f"method: {solution.method}",
        f"status: {solution.status.value}",
        f"poses: {_rate(time).replace('samples', 'frames')}",
        f"duration: {time[-1] - time[0]:.3f} s (from {time[0]:.3f} s to {time[-1]:.3f} s)",
        f"covariance: {_covariance(solution)}",
    ]
    if solution.iterations:
        tried = f"iterations: {solution.iterations} (steps tried, all rounds)"
        lines.append(f"{tried}, cost {solution.cost[-1]:.6g}" if solution.cost else tried)
    lines.append(
        f"time spent: {solution.seconds_solve:.2f} s solving, {solution.seconds_compile:.2f} s "
        "compiling"
    )
    if solution.observed:
        lines.append(f"observed joints: {', '.join(solution.observed)}")
    lines += _body(solution.body) + _setup(solution.setup)
    return lines + [f"remark: {text}" for text in solution.remarks]


def _covariance(solution: Solution) -> str:
    if solution.covariance is None:
        return "none"
    return "every frame" + (", and neighbours" if solution.pair_covariance is not None else "")


def _motion(path: str | os.PathLike[str]) -> list[str]:
    motion = load_motion(path)
    time = np.asarray(motion.trajectory.time)
    lines = ["kind: motion", f"frames: {_rate(time).replace('samples', 'frames')}"]
    if len(time) > 1:
        lines.append(f"duration: {time[-1] - time[0]:.3f} s")
    lines += _body(motion.body)
    return lines + [f"{key}: {value}" for key, value in motion.facts.items()]
