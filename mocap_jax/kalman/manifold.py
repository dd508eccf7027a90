"""What the filter must know of the space its poses live in."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from jax import Array


class Manifold(NamedTuple):
    """Calculus of a pose manifold, as functions of tangent vectors (nv,) and matrices (nv, k)."""

    retract: Callable[[Array, Array], Array]
    """(q, delta) to the pose reached from q along delta."""
    difference: Callable[[Array, Array], Array]
    """(q_from, q_to) to delta; the inverse of `retract`."""
    shift: Callable[[Array, Array], Array]
    """(delta, X): adjoint of moving along delta, `Exp(-delta) X`: an error made before the move
    as it shows after it."""
    jacobian: Callable[[Array, Array], Array]
    """(delta, X): right Jacobian `Jr(delta) X`: a change of delta as it shows after the move."""
    jacobian_inverse: Callable[[Array, Array], Array]
    """(delta, X): `Jr(delta)^-1 X`."""


def vector_space() -> Manifold:
    """The flat manifold, on which everything reduces to the textbook filter."""
    unchanged = lambda delta, X: X  # noqa: E731
    return Manifold(
        retract=lambda q, delta: q + delta,
        difference=lambda q_from, q_to: q_to - q_from,
        shift=unchanged,
        jacobian=unchanged,
        jacobian_inverse=unchanged,
    )
