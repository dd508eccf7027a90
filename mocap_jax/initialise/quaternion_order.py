"""Measured orientations, of boards and of the root, whose quaternions look read in wrong order."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.initialise.orientation_check import misread_orders
from mocap_jax.initialise.reading_series import series_of
from mocap_jax.recording import InertialStream, Recording

# A root pose farther from a board's sample than this is not taken for the board's [s].
_NEAR = 0.05


def misread_boards(recording: Recording, sensors: Iterable[str]) -> dict[str, str]:
    """What is wrong with the orders of the boards' quaternions, by board.

    Args:
        recording: with accelerometers, whose world has z up.
        sensors: those whose other readings are not in doubt.
    """
    return _misread({name: recording.inertial[name] for name in sensors})


def misread_root(recording: Recording, body: Body, sensors: Iterable[str]) -> str | None:
    """The same of the measured root, which the boards on the root's segment are compared with.

    Args:
        recording: with accelerometers, whose world has z up.
        body: its sites carry the boards.
        sensors: those whose readings are not in doubt.
    """
    if recording.root is None or not len(recording.root.time) or not body.has_free_root:
        return None
    topology = body.topology
    site_of = {s.name: s.site for s in recording.setup.sensors}
    for name in sensors:
        site = topology.site_index(site_of.get(name, name))
        if topology.site_body[site] == topology.joint_body[0]:
            turn = Rotation.from_quat(np.asarray(body.site_quat)[site], scalar_first=True)
            seen = _as_root(recording, recording.inertial[name], turn)
            return _misread({name: seen}).get(name)
    return None


def _as_root(recording: Recording, stream: InertialStream, turn: Rotation) -> InertialStream:
    """A board's readings in the root's frame, with the root's orientation in place of its own."""
    assert recording.root is not None
    time, known = np.asarray(stream.time), np.asarray(recording.root.time)
    near = np.clip(np.searchsorted(known, time), 1, max(len(known) - 1, 1))
    near -= time - known[near - 1] < known[np.minimum(near, len(known) - 1)] - time
    near = np.minimum(near, len(known) - 1)
    orientation = np.array(np.asarray(recording.root.orientation)[near], float)
    orientation[np.abs(known[near] - time) > _NEAR] = np.nan
    R = turn.as_matrix()
    return dataclasses.replace(
        stream, accelerometer=np.asarray(stream.accelerometer) @ R.T,
        gyroscope=np.asarray(stream.gyroscope) @ R.T, orientation=orientation,
    )  # fmt: skip


def _misread(streams: dict[str, InertialStream]) -> dict[str, str]:
    measured = {n: s for n, s in streams.items() if np.isfinite(np.asarray(s.orientation)).any()}
    with np.errstate(invalid="ignore", divide="ignore"):
        return misread_orders({n: series_of(s) for n, s in measured.items()})
