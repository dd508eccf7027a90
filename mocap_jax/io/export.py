"""Motions in the formats of other programs, by suffix."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mocap_jax.body import Topology
from mocap_jax.errors import InputError
from mocap_jax.io.array_archive import pack_arrays
from mocap_jax.io.atomic import atomic_file
from mocap_jax.io.bvh import bvh_text
from mocap_jax.io.mcap_trajectory import coordinate_names, dof_names
from mocap_jax.io.opensim_motion import (
    ORIENTATIONS_SUFFIX,
    coordinates_text,
    orientations_text,
)
from mocap_jax.io.trc import trc_text
from mocap_jax.motion.motion import Motion
from mocap_jax.solution import Solution


def export_motion(path: str | os.PathLike[str], solution: Solution | Motion) -> None:
    """Write a motion for another program, whole or not at all.

    The suffix chooses the format:

    - `.bvh`: hierarchy and Euler angles; centimetres, degrees, Y up (see `mocap_jax.io.bvh`);
    - `.csv`: time [s], hinge angles [deg], slides and root position [m], quaternions (wxyz);
    - `.mot`, `.sto`: OpenSim coordinates, degrees and metres, Y up (see
      `mocap_jax.io.opensim_motion`); `.orientations.sto`: segment orientations as quaternions;
    - `.trc`: joint centres and sites as markers; millimetres, Y up (see `mocap_jax.io.trc`);
    - `.npz`: arrays `time`, `q`, `v`, `names` (of q), `dof_names` (of v), `covariance_diagonal`
      (rad^2, m^2) and the text `body_xml`; SI units, wxyz.

    Raises:
        InputError: unknown suffix (the valid ones are listed), the file cannot be written, or the
            motion does not fit the format.
    """
    suffix = Path(path).suffix.lower()
    if Path(path).name.lower().endswith(ORIENTATIONS_SUFFIX):
        suffix = ORIENTATIONS_SUFFIX
    if suffix not in _EXPORTERS:
        valid = ", ".join(_EXPORTERS)
        raise InputError(f"{path}: cannot export to '{suffix or 'no suffix'}'; valid: {valid}")
    try:
        content = _EXPORTERS[suffix](solution)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    with atomic_file(path) as stream:
        stream.write(content)


def _bvh(solution: Solution | Motion) -> bytes:
    return bvh_text(solution.body, solution.trajectory).encode()


def _coordinates(solution: Solution | Motion) -> bytes:
    return coordinates_text(solution.body, solution.trajectory).encode()


def _orientations(solution: Solution | Motion) -> bytes:
    return orientations_text(solution.body, solution.trajectory).encode()


def _trc(solution: Solution | Motion) -> bytes:
    return trc_text(solution.body, solution.trajectory).encode()


def _csv(solution: Solution | Motion) -> bytes:
    trajectory, topology = solution.trajectory, solution.body.topology
    units = _units(topology)
    q = np.asarray(trajectory.q, np.float64)
    q = np.where([unit == "deg" for unit in units], np.degrees(q), q)
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer, lineterminator="\n")
    names = zip(coordinate_names(topology), units, strict=True)
    writer.writerow(["time [s]", *(f"{n} [{u}]" if u else n for n, u in names)])
    table = np.concatenate([np.asarray(trajectory.time)[:, None], q], axis=1)
    writer.writerows([repr(x) for x in row] for row in table.tolist())
    return buffer.getvalue().encode()


def _units(topology: Topology) -> list[str]:
    """Unit of each number of q in a table; empty for quaternions."""
    per_kind = {"free": ["m"] * 3 + [""] * 4, "ball": [""] * 4, "hinge": ["deg"], "slide": ["m"]}
    return [unit for kind in topology.joint_types for unit in per_kind[kind]]


def _npz(solution: Solution | Motion) -> bytes:
    trajectory, topology = solution.trajectory, solution.body.topology
    arrays = {
        "time": np.asarray(trajectory.time),
        "q": np.asarray(trajectory.q),
        "names": np.array(coordinate_names(topology)),
        "dof_names": np.array(dof_names(topology)),
        "body_xml": np.array(solution.body.xml),
    }
    if trajectory.v is not None:
        arrays["v"] = np.asarray(trajectory.v)
    covariance = getattr(solution, "covariance", None)
    if covariance is not None:
        arrays["covariance_diagonal"] = np.diagonal(np.asarray(covariance), axis1=1, axis2=2)
    return pack_arrays(arrays)


_EXPORTERS: dict[str, Callable[[Solution | Motion], bytes]] = {
    ".bvh": _bvh,
    ".csv": _csv,
    ".npz": _npz,
    ".mot": _coordinates,
    ".sto": _coordinates,
    ORIENTATIONS_SUFFIX: _orientations,
    ".trc": _trc,
}
