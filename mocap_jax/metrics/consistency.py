"""Is the stated covariance honest? Normalised squared errors and coverage of intervals."""

from __future__ import annotations

import jax
import numpy as np
from jaxtyping import Float
from scipy.stats import norm

from mocap_jax.body import Body, difference
from mocap_jax.errors import InputError
from mocap_jax.metrics.align import align
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution
from mocap_jax.solution.poses import map_frames


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


def nees(
    solution: Solution, reference: Recording | Solution, *, from_time: float | None = None
) -> Float[np.ndarray, "t"]:
    """Normalised estimation error squared per degree of freedom, frame by frame.

    e' P^-1 e / nv with e the error in the tangent space at the estimate. Its mean is 1 when the
    covariance is honest; above 1 the estimate is overconfident. NaN where P is not positive
    definite (directions that nothing determines have no finite covariance).
    """
    error, covariance = tangent_errors(solution, reference, from_time)
    out = np.full(len(error), np.nan)
    for k, (e, P) in enumerate(zip(error, covariance, strict=True)):
        try:
            whitened = np.linalg.solve(np.linalg.cholesky(P), e)
        except np.linalg.LinAlgError:
            continue
        out[k] = whitened @ whitened / len(e)
    return out


def coverage(
    solution: Solution,
    reference: Recording | Solution,
    level: float = 0.95,
    *,
    from_time: float | None = None,
) -> Float[np.ndarray, "nv"]:
    """Share of frames, for each degree of freedom, in which the truth lies in its interval.

    The interval is the central one of the given level of a normal distribution with the stated
    standard deviation; honest covariances give about `level`.
    """
    if not 0 < level < 1:
        raise InputError(f"level {level:g}: must lie between 0 and 1 (for example 0.95)")
    error, covariance = tangent_errors(solution, reference, from_time)
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    bound = norm.ppf(0.5 + level / 2) * np.sqrt(np.maximum(variance, 0.0))
    return (np.abs(error) <= bound).mean(axis=0)
