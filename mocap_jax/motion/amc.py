"""Acclaim motion (`.amc`): joint angles of an ASF skeleton, frame by frame."""

from __future__ import annotations

import math
import os
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion.asf import Asf, asf_skeleton, read_asf
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.pose_arrays import assemble_poses, unwrap_angle, widened_range
from mocap_jax.motion.shapes import segment_shapes
from mocap_jax.motion.skeleton import R_WORLD_FILE, skeleton_body
from mocap_jax.motion.text_file import read_text
from mocap_jax.trajectory import Trajectory

AMC_RATE = 120.0
"""Frame rate [1/s] of the CMU database's AMC files, which do not carry one."""

_Tracks = dict[str, Float[np.ndarray, "t n"]]


def load_amc(
    path: Path,
    *,
    skeleton: str | os.PathLike[str] | None = None,
    fps: float | None = None,
    scale: float | None = None,
    skip: int | None = None,
) -> Motion:
    """Load an AMC clip with its skeleton; see `load_motion`."""
    asf = read_asf(skeleton if skeleton is not None else _skeleton_beside(path))
    tracks = {name: track[skip or 0 :] for name, track in read_amc(path, asf).items()}
    if not len(tracks["root"]):
        raise InputError(f"{path}: no frames are left after skipping {skip}")
    metres = asf.metres_per_unit if scale is None else scale
    joints = _joint_angles(asf, tracks)
    body, widened = _fitting_body(asf, metres, joints)
    root = _root_pose(asf, tracks["root"], metres)
    q = assemble_poses(body.topology, {"root": root} | joints)
    rate = AMC_RATE if fps is None else fps
    facts: dict[str, str | float | int | bool] = {
        "file": path.name, "skeleton": asf.path.name, "frame_rate_hz": rate,
        "frame_rate_from": "AMC default (the file carries none)" if fps is None else "argument",
        "metres_per_unit": metres, "skipped_frames": skip or 0,
        "widened_limits": ", ".join(widened),
    }  # fmt: skip
    return Motion(path.stem, body, Trajectory(jnp.arange(len(q)) / rate, jnp.asarray(q)), facts)


def _skeleton_beside(path: Path) -> Path:
    """`NN.asf` beside `NN_MM.amc`."""
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    skeleton = path.with_name(path.stem.split("_")[0] + ".asf")
    if not skeleton.is_file():
        raise InputError(
            f"{path}: its skeleton {skeleton.name} is not beside it; "
            "name one with --skeleton (skeleton=)"
        )
    return skeleton


def read_amc(path: Path, asf: Asf) -> _Tracks:
    """Values of each bone in every frame, in the order of its `dof` line, angles in radians.

    Raises:
        InputError: naming the line with an unknown bone, a wrong number of values or no number.
    """
    widths = {"root": 6} | {name: len(bone.dofs) for name, bone in asf.bones.items() if bone.dofs}
    values: dict[str, list[list[float]]] = {name: [] for name in widths}
    frames, line_number = 0, 0
    degrees = asf.degrees
    for line_number, line in enumerate(read_text(path).splitlines(), start=1):
        words = line.split()
        if not words or words[0][0] == "#":
            continue
        if words[0][0] == ":":
            degrees = {":degrees": True, ":radians": False}.get(words[0].lower(), degrees)
        elif len(words) == 1 and words[0].isdigit():
            _expect_complete(path, line_number, values, frames)
            frames += 1
        else:
            _read_entry(path, line_number, words, widths, values, frames)
    if not frames:
        raise InputError(f"{path}: the file holds no frames")
    _expect_complete(path, line_number, values, frames)
    return {name: _in_radians(np.array(rows), name, degrees) for name, rows in values.items()}


def _read_entry(
    path: Path,
    line: int,
    words: list[str],
    widths: dict[str, int],
    values: dict[str, list[list[float]]],
    frames: int,
) -> None:
    name = words[0]
    if name not in widths:
        raise InputError(
            f"{path}: line {line}: the skeleton has no moving bone '{name}'; valid: "
            + ", ".join(widths)
        )
    if len(words) != widths[name] + 1:
        raise InputError(
            f"{path}: line {line}: '{name}' needs {widths[name]} values, found {len(words) - 1}"
        )
    if len(values[name]) != frames - 1:
        reason = "before the first frame number" if not frames else f"twice in frame {frames}"
        raise InputError(f"{path}: line {line}: '{name}' stands {reason}")
    try:
        row = [float(word) for word in words[1:]]
    except ValueError as error:
        raise InputError(f"{path}: line {line}: {str(error).split(': ')[-1]} is not a number"
                         ) from None  # fmt: skip
    if not all(map(math.isfinite, row)):
        raise InputError(f"{path}: line {line}: '{name}' has a value that is not finite")
    values[name].append(row)


def _expect_complete(
    path: Path, line: int, values: dict[str, list[list[float]]], frames: int
) -> None:
    if sum(map(len, values.values())) == frames * len(values):
        return
    missing = next(name for name, rows in values.items() if len(rows) < frames)
    raise InputError(f"{path}: line {line}: frame {frames} ends without bone '{missing}'")


def _in_radians(track: np.ndarray, name: str, degrees: bool) -> np.ndarray:
    if degrees:
        track[:, 3 if name == "root" else 0 :] *= math.pi / 180
    return track


def _joint_angles(asf: Asf, tracks: _Tracks) -> dict[str, Float[np.ndarray, "t n"]]:
    """Coordinates of every joint but the root: quaternions (wxyz), or hinge angles [rad]."""
    names, joints = asf.names(), {}
    for bone in asf.bones.values():
        if len(bone.dofs) == 3:
            zyx = tracks[bone.name][:, [bone.dofs.index(d) for d in ("rz", "ry", "rx")]]
            R = Rotation.from_euler("ZYX", zyx)
            joints[names[bone.name]] = R.as_quat(scalar_first=True)
            continue
        for i, dof in enumerate(bone.dofs):
            joints[f"{names[bone.name]}_{dof}"] = unwrap_angle(tracks[bone.name][:, i])[:, None]
    return joints


def _fitting_body(
    asf: Asf, metres: float, joints: dict[str, Float[np.ndarray, "t n"]]
) -> tuple[Body, list[str]]:
    """Body whose limits include the clip, and the names of the joints whose limits were widened."""
    skeleton = asf_skeleton(asf, scale=metres)
    limited = {j.name: j.range for bone in skeleton.bones for j in bone.joints if j.range}
    wider = {
        name: new
        for name, limits in limited.items()
        if (new := widened_range(limits, joints[name])) != limits
    }
    skeleton = asf_skeleton(asf, scale=metres, ranges=wider)
    return skeleton_body(skeleton, segment_shapes(skeleton)), sorted(wider)


def _root_pose(
    asf: Asf, track: Float[np.ndarray, "t 6"], metres: float
) -> Float[np.ndarray, "t 7"]:
    position = R_WORLD_FILE.apply(track[:, :3] * metres)
    R = R_WORLD_FILE * asf.R_file_root * Rotation.from_euler("xyz", track[:, 3:])
    return np.hstack([position, R.as_quat(scalar_first=True)])
