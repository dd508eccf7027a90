"""Boards that move on the skin: displacements as unknowns beside the poses.

The optimiser solves for a body whose boards float on their segments; what it returns is the body's
own motion.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, with_floating_sites
from mocap_jax.estimate.observed_joints import observed_joints
from mocap_jax.measurement import FrameData
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution


def on_skin(body: Body, recording: Recording) -> Body:
    """The body with the recording's boards floating on their segments."""
    known = body.topology.site_names
    sites = [s.site for s in recording.setup.sensors if s.name in recording.inertial]
    return with_floating_sites(body, [known.index(s) for s in sites if s in known])


def displaced(q: Float[np.ndarray, "t nq"], body: Body) -> Float[np.ndarray, "t nq+3s"]:
    """Poses of the body itself, for the body with floating boards: none is displaced."""
    return np.hstack([q, np.zeros((len(q), body.nq - q.shape[1]))])


def without_skin(solution: Solution, body: Body, data: FrameData) -> Solution:
    """What a solution for floating boards says about the body itself."""
    path, nq, nv = solution.trajectory, body.nq, body.nv
    cut = lambda c: None if c is None else c[:, :nv, :nv]  # noqa: E731
    return dataclasses.replace(
        solution,
        body=body,
        trajectory=dataclasses.replace(
            path, q=path.q[:, :nq], v=None if path.v is None else path.v[:, :nv]
        ),
        covariance=cut(solution.covariance),
        pair_covariance=cut(solution.pair_covariance),
        observed=observed_joints(body, data),
    )
