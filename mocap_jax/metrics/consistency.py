"""Is the stated covariance honest? Normalised squared errors and coverage of intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import jax
import numpy as np
from jaxtyping import Float
from scipy.special import chdtri, ndtri

from mocap_jax.body import Body, difference
from mocap_jax.body.topology import DOF_WIDTH
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.metrics.align import align
from mocap_jax.metrics.observed import observed_segments
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution
from mocap_jax.solution.poses import map_frames, root_segment

Part = Literal["pose", "joints"]


@jax.jit
def _differences(body: Body, q: jax.Array, q_true: jax.Array) -> jax.Array:
    return jax.vmap(lambda a, b: difference(body.topology, a, b))(q, q_true)


def tangent_errors(
    solution: Solution, reference: Recording | Solution, from_time: float | None = None
) -> tuple[Float[np.ndarray, "t nv"], Float[np.ndarray, "t nv nv"]]:
    """Errors in the tangent space at the estimated pose, and their stated covariance.

    Raises:
        InputError: the solution has no covariance, or the bodies differ in structure.
    """
    if solution.covariance is None:
        raise InputError(f"the solution (method {solution.method}) has no covariance")
    pair = align(solution, reference, from_time)
    if not pair.same_structure:
        raise InputError(
            "solution and reference have bodies of different structure, so their poses cannot be "
            "subtracted (use a reference with the same tree of joints)"
        )
    error = map_frames(_differences, (pair.body,), pair.q, pair.reference_q)
    return error, np.asarray(solution.covariance)[pair.frames]


def chi_square_band(count: int, level: float = 0.95) -> tuple[float, float]:
    """Interval of the mean of `count` squared independent standard normal values.

    A mean NEES or NIS per degree of freedom lies inside with probability `level` when covariances
    are honest and the values independent. `count` is runs x degrees of freedom: errors of
    successive frames of one run are alike, so frames do not count.
    """
    _check_level(level)
    if count < 1:
        raise InputError(f"count={count}: must be at least 1")
    low, high = chdtri(count, [0.5 + level / 2, 0.5 - level / 2]) / count
    return float(low), float(high)


def nees(
    solution: Solution,
    reference: Recording | Solution,
    *,
    part: Part = "pose",
    from_time: float | None = None,
) -> Float[np.ndarray, "t"]:
    """Normalised estimation error squared (NEES) per degree of freedom, frame by frame.

    e' P^-1 e / n, with e the error in the tangent space at the estimate (true pose =
    `retract(q, e)`), P its covariance and n the number of degrees of freedom. n times it has a
    chi-square distribution of n degrees of freedom when P is honest, so the mean is 1; above 1
    the estimate is overconfident. `chi_square_band` gives the interval of a mean over runs.

    Args:
        solution: an estimate with covariance.
        reference: a recording with truth, or another solution, on a body of the same structure.
        part: "pose": all degrees of freedom, for estimates whose root pose was given (it then has
            the covariance of that measurement). "joints": those that do not move the root
            segment, with their marginal covariance: the choice for a free root, whose position and
            heading nothing measures.
        from_time: first time scored [s]; default `solution.setup.score_from`.

    Returns:
        One value a frame. NaN where P is not positive definite (directions that nothing determines
        have no finite covariance).

    Raises:
        InputError: no covariance, bodies of different structure, or another `part`.
    """
    error, covariance = tangent_errors(solution, reference, from_time)
    chosen = _dofs_of(solution.body, part)
    out = np.full(len(error), np.nan)
    for k, (e, P) in enumerate(zip(error, covariance, strict=True)):
        try:
            root = np.linalg.cholesky(P[np.ix_(chosen, chosen)])
        except np.linalg.LinAlgError:
            continue
        whitened = np.linalg.solve(root, e[chosen])
        out[k] = whitened @ whitened / len(chosen)
    return out


def _dofs_of(body: Body, part: Part) -> np.ndarray:
    if part == "pose":
        return np.arange(body.nv)
    if part != "joints":
        raise unknown_name("part", part, ("pose", "joints"))
    topology = body.topology
    joints = np.flatnonzero(~np.asarray(topology.body_dofs, bool)[root_segment(topology)])
    if not len(joints):
        raise InputError("the body has no joints beside the root's; valid: part='pose'")
    return joints


def coverage(
    solution: Solution,
    reference: Recording | Solution,
    level: float = 0.95,
    *,
    from_time: float | None = None,
) -> Float[np.ndarray, "nv"]:
    """Share of frames, for each degree of freedom, in which the truth lies in its interval.

    The interval is the central one of the given level of a normal distribution with the stated
    standard deviation; honest covariances give about `level`. Degrees of freedom are in the order
    of `solution.poses.dof_names`; those of the root mean something only where its pose was given.
    """
    _check_level(level)
    error, covariance = tangent_errors(solution, reference, from_time)
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    return (np.abs(error) <= _bound(variance, level)).mean(axis=0)


def _check_level(level: float) -> None:
    if not 0 < level < 1:
        raise InputError(f"level {level:g}: must lie between 0 and 1 (for example 0.95)")


def _bound(variance: Float[np.ndarray, "*b"], level: float) -> Float[np.ndarray, "*b"]:
    """Half width of the central interval of a normal distribution."""
    return ndtri(0.5 + level / 2) * np.sqrt(np.maximum(variance, 0.0))


@dataclass(frozen=True)
class JointConsistency:
    """Errors of joint rotations beside what the solution's own covariance predicts."""

    rms: float
    """Root mean square error of the rotation of a joint [rad]."""
    predicted_rms: float
    """The same as the covariance predicts it [rad]: from the trace of each joint's block."""
    coverage: float
    """Share of single components (over frames, joints and axes) inside their interval."""

    @property
    def ratio(self) -> float:
        """Error over its prediction: 1 when the covariance is honest, above 1 overconfident."""
        return self.rms / self.predicted_rms


def joint_consistency(
    solution: Solution,
    reference: Recording | Solution,
    level: float = 0.95,
    *,
    from_time: float | None = None,
) -> JointConsistency:
    """Compare errors of the observed joints' rotations with their stated uncertainty.

    The error of a joint is its part of the tangent vector from the estimate to the truth: the
    rotation vector of a ball joint, the angles of hinges. Means are over frames and joints, so
    that joints of any number of degrees of freedom count alike; slides do not count.

    Args:
        solution: an estimate with covariance.
        reference: a recording with truth, or another solution, on a body of the same structure.
        level: of the two-sided intervals of `coverage`.
        from_time: first time scored [s]; default `solution.setup.score_from`.

    Raises:
        InputError: no covariance, bodies of different structure, no observed joint, or a level
            outside 0 to 1.
    """
    _check_level(level)
    error, covariance = tangent_errors(solution, reference, from_time)
    chosen, joints = _observed_dofs(solution)
    error = error[:, chosen]
    variance = np.diagonal(covariance, axis1=1, axis2=2)[:, chosen]
    inside = np.abs(error) <= _bound(variance, level)
    count = len(error) * joints
    return JointConsistency(
        float(np.sqrt((error**2).sum() / count)),
        float(np.sqrt(variance.sum() / count)),
        float(inside.mean()),
    )


def _observed_dofs(solution: Solution) -> tuple[np.ndarray, int]:
    """Rotational degrees of freedom of the observed joints, and how many segments have them."""
    topology = solution.body.topology
    seen = solution.observed or observed_segments(
        solution.body,
        [s.site for s in solution.setup.sensors if s.site in topology.site_names],
    )
    dofs: list[int] = []
    segments: set[str] = set()
    for j, kind in enumerate(topology.joint_types):
        segment = topology.body_names[topology.joint_body[j]]
        if segment in seen and kind in ("ball", "hinge"):
            at = topology.joint_dof[j]
            dofs += range(at, at + DOF_WIDTH[kind])
            segments.add(segment)
    if not dofs:
        raise InputError("the solution's sensors observe no joint, so there is nothing to compare")
    return np.array(dofs), len(segments)
