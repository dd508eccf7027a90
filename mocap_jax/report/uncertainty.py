"""Stated uncertainty of quantities that a report shows; None where a solution states none."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.solution import Solution, propagate
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import root_segment


def relative_rotation_std(
    solution: Solution, segments: list[tuple[str, str]]
) -> Float[np.ndarray, "t n"] | None:
    """Root-mean-square angle [rad] that the covariance allows between pairs of segments.

    Returns:
        One column per pair (segment, base), or None where the solution has no covariance.
    """
    if solution.covariance is None:
        return None
    return propagate.relative_rotation_std(solution, segments)


def cardan_std(
    solution: Solution, segment: str, base: str, rows: np.ndarray
) -> Float[np.ndarray, "t 3"] | None:
    """Standard deviations [rad] of the Z-X-Y angles of a segment relative to another.

    Args:
        solution: with covariance; otherwise the result is None.
        segment: name of the segment.
        base: name of the segment it is relative to.
        rows: frames wanted.
    """
    if solution.covariance is None:
        return None
    return propagate.cardan_std(solution, segment, base, rows)


def angle_std(solution: Solution, rows: np.ndarray) -> dict[str, Float[np.ndarray, "t"]]:
    """Standard deviations [rad] of all joint angles by name; empty without covariance."""
    if solution.covariance is None:
        return {}
    names, std = propagate.joint_angle_std(solution, rows)
    return dict(zip(names, std.T, strict=True))


def root_relative_position_std(
    solution: Solution, segments: list[str], rows: np.ndarray
) -> Float[np.ndarray, "t n 3"] | None:
    """Standard deviations [m] of segments' positions in the root segment's anatomical frame."""
    if solution.covariance is None:
        return None
    topology = solution.body.topology
    chosen = [topology.body_index(n) for n in segments]
    P = propagate.segment_covariances(solution, rows).position_in_root[:, chosen]
    R_root_anatomical = anatomical_frames(solution.body)[root_segment(topology)]
    turned = R_root_anatomical.T @ P @ R_root_anatomical
    return np.sqrt(np.maximum(np.diagonal(turned, axis1=2, axis2=3), 0.0))
