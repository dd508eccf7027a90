"""What the solver needs to know of a problem: cost, normal equations, and where a step leads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from mocap_jax import linalg


@dataclass(frozen=True)
class NormalEquations:
    """Cost and quadratic model at a state: lower blocks of J'J, gradient J'r, border."""

    cost: float
    lower: np.ndarray
    """(t, b + 1, d, d), may be overwritten by the solver."""
    gradient: np.ndarray
    """(t, d)"""
    corner: np.ndarray | None
    """(m, m), None without constants."""
    corner_gradient: np.ndarray
    """(m,)"""
    border: linalg.BorderBlocks | None


Follow = Callable[[np.ndarray, linalg.BorderBlocks | None, int], None]
"""What a problem may call while it makes its equations: (lower, border, number of frames whose
blocks are final). The solver factors these frames meanwhile."""


class Problem(Protocol):
    """What the solver needs to know."""

    @property
    def unknowns(self) -> int: ...

    def cost(self, state: Any) -> float: ...

    def linearise(self, state: Any, follow: Follow | None = None) -> NormalEquations: ...

    def move(self, state: Any, step: np.ndarray, constants: np.ndarray) -> Any: ...

    @property
    def refines(self) -> bool:
        """Whether J'J loses digits that `model` keeps: then steps are refined with it."""
        ...

    @property
    def bends(self) -> np.ndarray:
        """Which unknowns of a frame take part in curved terms (d,): their jitter is damped."""
        ...

    @property
    def least_damping(self) -> float:
        """Damping of second differences that hardly slows convergence [1/rad^2, 1/m^2]."""
        ...

    def model(
        self, state: Any, x: np.ndarray, z: np.ndarray, *, offset: bool, damping: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """J'(r + J (x, z)) + damping (x, z), or without r where `offset` is false."""
        ...
