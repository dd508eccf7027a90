"""Stated uncertainty of quantities that a report shows, from the covariance of the poses."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, frames
from mocap_jax.solution import Solution
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.cardan import cardan_zxy
from mocap_jax.solution.poses import map_frames, segment_poses


@jax.jit
def _angular_screws(body: Body, q: jax.Array) -> jax.Array:
    return jax.vmap(lambda one: frames(body, one).angular)(q)


def relative_rotation_std(
    solution: Solution, segments: list[tuple[str, str]]
) -> Float[np.ndarray, "t n"] | None:
    """Root-mean-square angle [rad] that the covariance allows between pairs of segments.

    For each pair (segment, base) the rotation of the segment relative to the base has, to first
    order, the world rotation vector A' delta, with A the world axes of the degrees of freedom
    that lie between them; the result is sqrt(trace(A' P A)).

    Returns:
        One column per pair, or None where the solution has no covariance.
    """
    if solution.covariance is None:
        return None
    body, topology = solution.body, solution.body.topology
    axes = map_frames(
        _angular_screws, (dataclasses.replace(body, xml=""),), np.asarray(solution.trajectory.q)
    )
    P = np.asarray(solution.covariance)
    columns = []
    for segment, base in segments:
        moved = topology.body_dofs[topology.body_index(segment)].astype(float)
        moved -= topology.body_dofs[topology.body_index(base)]
        A = axes * moved[None, :, None]
        variance = np.einsum("tvi,tvw,twi->t", A, P, A, optimize=True)
        columns.append(np.sqrt(np.maximum(variance, 0.0)))
    return np.stack(columns, axis=1) if columns else np.zeros((len(P), 0))


def cardan_std(
    solution: Solution, segment: str, base: str, rows: np.ndarray
) -> Float[np.ndarray, "t 3"] | None:
    """Standard deviations [rad] of the Z-X-Y angles of a segment relative to another.

    To first order: the rotation vector of the relative rotation, in the base's anatomical frame,
    is R' A' delta (A as in `relative_rotation_std`), and moves the angles by the inverse of their
    rotation axes. Near gimbal lock it grows without bound.

    Args:
        solution: with covariance; otherwise the result is None.
        segment: name of the segment.
        base: name of the segment it is relative to.
        rows: frames wanted.
    """
    if solution.covariance is None:
        return None
    body, topology = solution.body, solution.body.topology
    b, root = topology.body_index(segment), topology.body_index(base)
    q = np.asarray(solution.trajectory.q)[rows]
    axes = map_frames(_angular_screws, (dataclasses.replace(body, xml=""),), q)
    moved = topology.body_dofs[b].astype(float) - topology.body_dofs[root]
    R_world, _ = segment_poses(body, q)
    anatomical = anatomical_frames(body)
    R_world_base = R_world[:, root] @ anatomical[root]
    R_base_segment = np.swapaxes(R_world_base, 1, 2) @ R_world[:, b] @ anatomical[b]
    to_angles = np.linalg.pinv(_rotation_axes(cardan_zxy(R_base_segment)))
    J = to_angles @ np.swapaxes(R_world_base, 1, 2) @ np.swapaxes(axes * moved[:, None], 1, 2)
    variance = np.einsum("tav,tvw,taw->ta", J, np.asarray(solution.covariance)[rows], J,
                         optimize=True)  # fmt: skip
    return np.sqrt(np.maximum(variance, 0.0))


def _rotation_axes(angles: Float[np.ndarray, "t 3"]) -> Float[np.ndarray, "t 3 3"]:
    """Axes (columns) about which the three angles turn, in the base frame."""
    z, x, _ = angles.T
    zero, one = np.zeros_like(z), np.ones_like(z)
    cz, sz, cx, sx = np.cos(z), np.sin(z), np.cos(x), np.sin(x)
    columns = [[zero, zero, one], [cz, sz, zero], [-sz * cx, cz * cx, sx]]
    return np.array(columns).transpose(2, 1, 0)


def coordinate_std(solution: Solution, dof: int) -> Float[np.ndarray, "t"] | None:
    """Standard deviation of one degree of freedom over time, or None without covariance."""
    if solution.covariance is None:
        return None
    return np.sqrt(np.maximum(np.asarray(solution.covariance)[:, dof, dof], 0.0))
