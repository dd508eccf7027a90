"""Piecewise polynomials of one variable: how one joint coordinate follows another."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float


@dataclass(frozen=True)
class Piecewise:
    """f(x) = sum over k of coefficients[i][k] (x - origins[i])^k, on the piece i that holds x.

    Piece i reaches from `breaks[i - 1]` to `breaks[i]`; the first and the last are unbounded.
    """

    breaks: tuple[float, ...]
    origins: tuple[float, ...]
    coefficients: tuple[tuple[float, ...], ...]
    """One tuple a piece, constant term first, all of the same length."""

    def __call__(self, x: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """Value, in NumPy."""
        x = np.asarray(x, float)
        i = np.searchsorted(np.array(self.breaks), x)
        table, shift = np.array(self.coefficients), x - np.array(self.origins)[i]
        value = np.zeros_like(x)
        for k in range(table.shape[1] - 1, -1, -1):
            value = value * shift + table[i, k]
        return value

    def at(self, x: Float[Array, ""]) -> Float[Array, ""]:
        """Value, in JAX; differentiable."""
        i = jnp.searchsorted(jnp.array(self.breaks, x.dtype), x)
        terms = jnp.array(self.coefficients, x.dtype)[i]
        shift = x - jnp.array(self.origins, x.dtype)[i]
        value = jnp.zeros_like(x)
        for k in range(len(self.coefficients[0]) - 1, -1, -1):
            value = value * shift + terms[k]
        return value

    @property
    def line(self) -> tuple[float, float] | None:
        """(value at zero, slope) if this is one straight line; otherwise None."""
        if len(self.coefficients) > 1 or any(self.coefficients[0][2:]):
            return None
        constant, slope = (*self.coefficients[0], 0.0)[:2]
        return constant - slope * self.origins[0], slope

    def scaled(self, factor: float) -> Piecewise:
        """`factor` times this function."""
        table = tuple(tuple(factor * c for c in row) for row in self.coefficients)
        return Piecewise(self.breaks, self.origins, table)


def straight(constant: float, slope: float = 0.0) -> Piecewise:
    """A constant, or a straight line."""
    return Piecewise((), (0.0,), ((constant, slope),))


def pieced(breaks: Float[np.ndarray, "n"], coefficients: Float[np.ndarray, "n-1 k"]) -> Piecewise:
    """Pieces between neighbouring breaks, each a polynomial of the distance from its lower break.

    Beyond the first and the last break the function goes on along its tangent.
    """
    degree = np.arange(coefficients.shape[1])
    step = breaks[-1] - breaks[-2]
    value = float(coefficients[-1] @ step**degree)
    slope = float(coefficients[-1, 1:] @ (degree[1:] * step ** (degree[1:] - 1)))
    padding = [0.0] * (coefficients.shape[1] - 2)
    rows = [[*coefficients[0, :2], *padding], *coefficients, [value, slope, *padding]]
    origins = [breaks[0], *breaks[:-1], breaks[-1]]
    return Piecewise(
        tuple(map(float, breaks)),
        tuple(map(float, origins)),
        tuple(tuple(map(float, row)) for row in rows),
    )
