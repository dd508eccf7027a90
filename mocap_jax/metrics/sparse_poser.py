"""The Sparse Inertial Poser's metrics (von Marcard 2017, eq. 33 and 34, section 5.3).

Printed with squared norms, but reported in degrees and metres: mean and standard deviation are of
the norms themselves, over all frames and sensors (markers) together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Topology
from mocap_jax.errors import InputError
from mocap_jax.metrics.align import Aligned, align
from mocap_jax.metrics.joint_centres import joint_centres
from mocap_jax.metrics.rotation_angle import rotation_angle
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import root_segment, segment_poses

VALIDATION_SEGMENTS = ("LeftUpperLeg", "RightUpperLeg", "LeftUpperArm", "RightUpperArm")
"""Segments whose sensors validate: thighs and upper arms."""
MARKERS = (
    *(side + name for name in ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "ForeArm", "Hand")
      for side in ("Left", "Right")),
    "Neck",
)  # fmt: skip
"""Segments at whose joints the 13 virtual markers are: hips, knees, ankles, shoulders, elbows,
wrists and neck."""

Poses = tuple[np.ndarray, np.ndarray]


def sparse_poser_errors(pair: Aligned, poses: Poses, true: Poses) -> dict[str, dict[str, float]]:
    """Errors by segment, and pooled under `mean`; none where the bodies have no such segment.

    - `validation_orientation_error_mean_deg`, `..._std_deg`: angle between estimated and true
      orientation in the world of the segments whose sensors were held out (of their anatomical
      frames, where the two bodies are different skeletons).
    - `marker_position_error_mean_cm`, `..._std_cm`: distance of virtual markers, relative to the
      root's position (to the middle of the hips, where the two bodies are different skeletons).
    """
    mine, other = (set(b.topology.body_names) for b in (pair.body, pair.reference_body))
    errors: dict[str, dict[str, float]] = {}
    for names, measure, key, unit in (
        (VALIDATION_SEGMENTS, _angles, "validation_orientation_error", "deg"),
        (MARKERS, _distances, "marker_position_error", "cm"),
    ):
        shared = [n for n in names if n in mine & other]
        if not shared:
            continue
        values = measure(pair, poses, true, shared)
        for what, of in (("mean", np.mean), ("std", np.std)):
            row = {n: float(of(v)) for n, v in zip(shared, values.T, strict=True)}
            errors[f"{key}_{what}_{unit}"] = row | {"mean": float(of(values))}
    return errors


class Series(NamedTuple):
    """Errors over time, averaged over segments and over markers."""

    time: Float[np.ndarray, "t"]
    """[s]"""
    orientation: Float[np.ndarray, "t"]
    """Of the segments whose sensors were held out [deg]."""
    position: Float[np.ndarray, "t"]
    """Of the virtual markers [cm]."""


def sparse_poser_series(
    solution: Solution, reference: Recording | Solution, *, from_time: float | None = None
) -> Series:
    """The metrics over time (von Marcard 2017, figure 8); arguments as of `evaluate`.

    Raises:
        InputError: no truth, or bodies without thighs, upper arms and the markers' joints.
    """
    pair = align(solution, reference, from_time)
    poses = segment_poses(pair.body, pair.q)
    true = segment_poses(pair.reference_body, pair.reference_q)
    mine, other = (set(b.topology.body_names) for b in (pair.body, pair.reference_body))
    means = []
    for names, measure in ((VALIDATION_SEGMENTS, _angles), (MARKERS, _distances)):
        shared = [n for n in names if n in mine & other]
        if not shared:
            raise InputError(f"the bodies share none of the segments {', '.join(names)}")
        means.append(measure(pair, poses, true, shared).mean(axis=1))
    return Series(np.asarray(pair.time), *means)


def _chosen(pair: Aligned, names: list[str]) -> tuple[list[int], list[int]]:
    mine, other = pair.body.topology, pair.reference_body.topology
    return [mine.body_index(n) for n in names], [other.body_index(n) for n in names]


def _angles(pair: Aligned, poses: Poses, true: Poses, names: list[str]) -> np.ndarray:
    mine, other = _chosen(pair, names)
    R, R_true = poses[0][:, mine], true[0][:, other]
    if not _same_skeleton(pair):
        # Skeletons lay their segments' frames differently.
        R = R @ anatomical_frames(pair.body)[mine]
        R_true = R_true @ anatomical_frames(pair.reference_body)[other]
    return np.rad2deg(rotation_angle(R, R_true))


def _distances(pair: Aligned, poses: Poses, true: Poses, names: list[str]) -> np.ndarray:
    same = _same_skeleton(pair)
    sides = []
    for body, (R, p), chosen in zip(
        (pair.body, pair.reference_body), (poses, true), _chosen(pair, names), strict=True
    ):
        centre = joint_centres(body, R, p)
        sides.append(centre[:, chosen] - _middle(body.topology, centre, p, by_hips=not same))
    return 100 * np.linalg.norm(sides[0] - sides[1], axis=-1)


def _same_skeleton(pair: Aligned) -> bool:
    return pair.body.topology.body_names == pair.reference_body.topology.body_names


def _middle(
    topology: Topology, centre: np.ndarray, p: np.ndarray, *, by_hips: bool
) -> Float[np.ndarray, "t 1 3"]:
    """The root's position, or the middle of the hips: skeletons lay their root differently."""
    hips = [s for s in ("LeftUpperLeg", "RightUpperLeg") if s in topology.body_names]
    if not by_hips or len(hips) < 2:
        return p[:, [root_segment(topology)]]
    return centre[:, [topology.body_index(h) for h in hips]].mean(axis=1, keepdims=True)
