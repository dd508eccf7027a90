"""Covariances of a solution's poses, and of neighbouring poses, as topics of its file."""

from __future__ import annotations

import numpy as np
from jax import Array, device_put

from mocap_jax.errors import InputError
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io.mcap_read import Contents
from mocap_jax.io.mcap_trajectory import file_start
from mocap_jax.io.mcap_write import McapFile, stamps_from_seconds
from mocap_jax.solution import Solution
from mocap_jax.trajectory import Trajectory

_POSES = "/solution/covariance"
_PAIRS = "/solution/pair_covariance"


def add_covariances(file: McapFile, solution: Solution) -> None:
    """Add the topics of what the solution has.

    Raises:
        InputError: their shape does not fit the trajectory.
    """
    time, nv = np.asarray(solution.trajectory.time), solution.body.nv
    if solution.covariance is not None:
        covariance = _fitting("covariance", solution.covariance, len(time), nv)
        stamps = stamps_from_seconds(time, file.start_utc_ns, _POSES)
        file.add_topic(_POSES, pb.Covariance, stamps, pb.encode_covariances(stamps, covariance))
    if solution.pair_covariance is not None and len(time) > 1:
        pairs = _fitting("pair covariance", solution.pair_covariance, len(time) - 1, nv)
        stamps = stamps_from_seconds(time, file.start_utc_ns, _PAIRS)
        payloads = pb.encode_pair_covariances(stamps, pairs)
        file.add_topic(_PAIRS, pb.PairCovariance, stamps[:-1], payloads)


def _fitting(what: str, values: Array | np.ndarray, count: int, nv: int) -> np.ndarray:
    array = np.asarray(values, np.float64)
    if array.shape != (count, nv, nv):
        noun = "poses" if what == "covariance" else "pairs of neighbouring poses"
        raise InputError(
            f"{what} of shape {array.shape} does not fit {count} {noun} of {nv} degrees of freedom"
        )
    return array


def read_covariances(
    contents: Contents, trajectory: Trajectory
) -> tuple[Trajectory, Array | None, Array | None, tuple[str, ...]]:
    """The trajectory's frames that have a covariance, the covariances, and what is lost.

    Covariances of neighbours come whole or not at all: a gap would leave them without use.
    """
    trajectory, covariance = _read_poses(contents, trajectory)
    if not contents.payloads.get(_PAIRS):
        return trajectory, covariance, None, ()
    own = _stamps(contents, trajectory)
    first, second, pairs = pb.decode_pair_covariances(contents.payloads[_PAIRS])
    row = {pair: i for i, pair in enumerate(zip(first.tolist(), second.tolist(), strict=True))}
    wanted = list(zip(own[:-1].tolist(), own[1:].tolist(), strict=True))
    if not wanted or not row.keys() >= set(wanted):
        lost = "covariances of neighbouring poses are incomplete and left out"
        return trajectory, covariance, None, (lost,)
    return trajectory, covariance, device_put(pairs[[row[pair] for pair in wanted]]), ()


def _read_poses(contents: Contents, trajectory: Trajectory) -> tuple[Trajectory, Array | None]:
    if not contents.payloads.get(_POSES):
        return trajectory, None
    stamps, covariance = pb.decode_covariances(contents.payloads[_POSES])
    own = _stamps(contents, trajectory)
    if np.array_equal(own, stamps):
        return trajectory, device_put(covariance)
    # A truncated file can hold fewer messages on one of the topics.
    _, keep, rows = np.intersect1d(own, stamps, return_indices=True)
    v = None if trajectory.v is None else trajectory.v[keep]
    kept = Trajectory(trajectory.time[keep], trajectory.q[keep], v)
    return kept, device_put(covariance[rows])


def _stamps(contents: Contents, trajectory: Trajectory) -> np.ndarray:
    return np.rint(np.asarray(trajectory.time) * 1e9).astype(np.int64) + file_start(contents)
