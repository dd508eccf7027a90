"""Trajectories as MCAP topics: joint states to read back, frame transforms for viewers."""

from __future__ import annotations

import numpy as np
from jax import device_put

from mocap_jax.body import Body, Topology
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io import ros_messages as ros
from mocap_jax.io.mcap_read import Contents
from mocap_jax.io.mcap_write import McapFile, stamps_from_seconds
from mocap_jax.io.world_frames import relative_frames
from mocap_jax.trajectory import Trajectory

TRANSFORM_RATE_HZ = 30.0
"""Transforms serve viewers only and are thinned to about this rate."""

_QPOS_SUFFIX = {
    "free": (":x", ":y", ":z", ":qw", ":qx", ":qy", ":qz"),
    "ball": (":qw", ":qx", ":qy", ":qz"),
    "hinge": ("",),
    "slide": ("",),
}
_DOF_SUFFIX = {
    "free": (":vx", ":vy", ":vz", ":wx", ":wy", ":wz"),
    "ball": (":wx", ":wy", ":wz"),
    "hinge": ("",),
    "slide": ("",),
}


def coordinate_names(topology: Topology) -> tuple[str, ...]:
    """Name of each number of q: `<joint>`, or `<joint>:x|y|z|qw|qx|qy|qz` where it has several."""
    return _names(topology, _QPOS_SUFFIX)


def dof_names(topology: Topology) -> tuple[str, ...]:
    """Name of each number of v: `<joint>`, or `<joint>:vx|vy|vz|wx|wy|wz` where it has several."""
    return _names(topology, _DOF_SUFFIX)


def _names(topology: Topology, suffixes: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(
        joint + suffix
        for joint, kind in zip(topology.joint_names, topology.joint_types, strict=True)
        for suffix in suffixes[kind]
    )


def add_trajectory(
    file: McapFile, prefix: str, body: Body, trajectory: Trajectory, frame_prefix: str = ""
) -> None:
    """Add `<prefix>/joint_states`, `<prefix>/joint_velocities` and `<prefix>/transforms`.

    Raises:
        InputError: the trajectory does not fit the body.
    """
    q = np.asarray(trajectory.q, np.float64)
    time = np.asarray(trajectory.time, np.float64)
    if q.shape != (len(time), body.nq):
        raise InputError(
            f"trajectory of shape {q.shape} does not fit {len(time)} times and a body of "
            f"{body.nq} coordinates"
        )
    stamps = stamps_from_seconds(time, file.start_utc_ns, f"{prefix} trajectory")
    states = ros.encode_joint_states(coordinate_names(body.topology), stamps, q)
    file.add_topic(f"{prefix}/joint_states", ros.JOINT_STATE, stamps, states)
    if trajectory.v is not None:
        v = np.asarray(trajectory.v, np.float64)
        if v.shape != (len(time), body.nv):
            raise InputError(f"velocities of shape {v.shape} do not fit {body.nv} dofs")
        rates = ros.encode_joint_states(dof_names(body.topology), stamps, v, velocity=True)
        file.add_topic(f"{prefix}/joint_velocities", ros.JOINT_STATE, stamps, rates)
    _add_transforms(file, f"{prefix}/transforms", body, time, q, frame_prefix)


def _add_transforms(
    file: McapFile, topic: str, body: Body, time: np.ndarray, q: np.ndarray, frame_prefix: str
) -> None:
    names, parents = body.topology.body_names, body.topology.body_parent
    label = lambda b: names[b] if b == 0 else frame_prefix + names[b]  # noqa: E731
    pairs = [(label(parents[b]), label(b)) for b in range(1, len(names))]
    chosen = thinned(time, TRANSFORM_RATE_HZ)
    chosen = chosen[np.isfinite(q[chosen]).all(axis=1)]
    stamps = stamps_from_seconds(time[chosen], file.start_utc_ns, topic)
    translation, rotation = relative_frames(body, q[chosen])
    payloads = pb.encode_transforms(pairs, stamps, translation, rotation)
    file.add_topic(topic, pb.FrameTransforms, stamps, payloads)


def thinned(time: np.ndarray, rate_hz: float) -> np.ndarray:
    """Indices of about `rate_hz` samples a second, evenly spaced."""
    if len(time) < 3:
        return np.arange(len(time))
    every = max(1, int(np.floor(1.0 / (rate_hz * float(np.median(np.diff(time)))) + 0.5)))
    return np.arange(0, len(time), every)


def read_trajectory(contents: Contents, prefix: str, topology: Topology) -> Trajectory:
    """Read a trajectory back.

    Raises:
        InputError: there is none, or its joints are not those of the body.
    """
    topic = f"{prefix}/joint_states"
    if not contents.payloads.get(topic):
        raise InputError(f"no messages on {topic}")
    names, stamps, q = ros.decode_joint_states(contents.payloads[topic], contents.schema(topic))
    q = _ordered(q, names, coordinate_names(topology))
    v = None
    topic = f"{prefix}/joint_velocities"
    if contents.payloads.get(topic):
        names, at, values = ros.decode_joint_states(
            contents.payloads[topic], contents.schema(topic), velocity=True
        )
        # A truncated file can hold one message less on one of the two topics.
        stamps, in_q, in_v = np.intersect1d(stamps, at, return_indices=True)
        q, v = q[in_q], device_put(_ordered(values, names, dof_names(topology))[in_v])
    time = (stamps - file_start(contents)) / 1e9
    return Trajectory(device_put(time), device_put(q), v)


def _ordered(values: np.ndarray, names: tuple[str, ...], wanted: tuple[str, ...]) -> np.ndarray:
    for name in wanted:
        if name not in names:
            raise unknown_name("joint coordinate of the body", name, names)
    return values if names == wanted else values[:, [names.index(n) for n in wanted]]


def file_start(contents: Contents) -> int:
    """Absolute start of a file [ns]: as declared, else its first message's time."""
    declared = contents.metadata.get("mocap_jax", {}).get("start_utc_ns", "")
    if declared.lstrip("-").isdigit():
        return int(declared)
    return contents.first_log_time or 0
