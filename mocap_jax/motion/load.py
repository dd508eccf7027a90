"""`load_motion`: motion files by suffix."""

from __future__ import annotations

import math
import os
from pathlib import Path

from mocap_jax.errors import InputError
from mocap_jax.motion.amc import load_amc
from mocap_jax.motion.bvh import load_bvh
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.npz import load_npz

MOTION_SUFFIXES = (".amc", ".bvh", ".npz")
SCALED_SUFFIXES = (".amc", ".bvh")
"""Those whose unit of length may be given."""
SKELETON_SUFFIXES = (".amc",)
"""Those that need a skeleton of another file."""


def load_motion(
    path: str | os.PathLike[str],
    *,
    skeleton: str | os.PathLike[str] | None = None,
    fps: float | None = None,
    scale: float | None = None,
    skip: int | None = None,
) -> Motion:
    """Load a motion capture clip with the body it belongs to: Z up, X forward, metres.

    Args:
        path: `.amc` (its skeleton `NN.asf` is sought beside `NN_MM.amc`), `.bvh`, or `.npz` with
            arrays `time` (t) [s], `q` (t nq) and `body_xml` (MJCF text).
        skeleton: ASF file of an AMC clip.
        fps: frame rate [1/s]; by default a BVH header's own, 120 for AMC, an NPZ's own times.
        scale: metres per unit of length in an AMC or BVH file. By default the ASF's unit; for
            BVH, centimetres when the skeleton is more than 30 units tall, else CMU's unit
            (1 / 0.45 inch). What was used stands in the motion's facts.
        skip: frames to drop at the start; by default none, or one where the first row of a BVH is
            an inserted rest pose (all rotations zero, or the root's and then a jump).

    Raises:
        InputError: naming the file, the line and the fault.
    """
    path = Path(path)
    for name, value in (("fps", fps), ("scale", scale)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} must be a positive number, got {value}")
    if skip is not None and skip < 0:
        raise InputError(f"skip must be 0 or more frames, got {skip}")
    suffix = path.suffix.lower()
    if skeleton is not None and suffix not in SKELETON_SUFFIXES:
        raise InputError(f"{path}: skeleton= is for .amc clips only")
    if suffix == ".amc":
        return load_amc(path, skeleton=skeleton, fps=fps, scale=scale, skip=skip)
    if suffix == ".bvh":
        return load_bvh(path, fps=fps, scale=scale, skip=skip)
    if suffix == ".npz":
        if scale is not None:
            raise InputError(f"{path}: scale= is for .amc and .bvh clips (NPZ is in metres)")
        return load_npz(path, fps=fps, skip=skip)
    valid = ", ".join(MOTION_SUFFIXES)
    raise InputError(f"{path}: unknown kind of motion '{path.suffix}'; valid: {valid}")
