"""Stated uncertainty of quantities that a report shows, from the covariance of the poses."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, frames
from mocap_jax.solution import Solution
from mocap_jax.solution.poses import map_frames


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


def coordinate_std(solution: Solution, dof: int) -> Float[np.ndarray, "t"] | None:
    """Standard deviation of one degree of freedom over time, or None without covariance."""
    if solution.covariance is None:
        return None
    return np.sqrt(np.maximum(np.asarray(solution.covariance)[:, dof, dof], 0.0))
