"""`State`: the Gaussian belief that the filter carries."""

from __future__ import annotations

from typing import NamedTuple

from jax import Array
from jaxtyping import Float


class State(NamedTuple):
    """Mean (q, v, a) and covariance of the errors (dq, dv, da).

    The pose lies on a manifold: the true one is `retract(q, dq)`. Velocity and acceleration are
    coordinates in the moving tangent frame (left-trivialised), so their errors simply add and a
    change of the pose estimate leaves them as they are.
    """

    q: Float[Array, "nq"]
    v: Float[Array, "nv"]
    a: Float[Array, "nv"]
    covariance: Float[Array, "3*nv 3*nv"]
