"""The posterior of one motion under a placement: its arrow-shaped information matrix, factored.

Unlike the solver's factor, U'^-1 B is kept: studies are short, and many right-hand sides follow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import blas, lapack

from mocap_jax import linalg
from mocap_jax.errors import SolveError
from mocap_jax.linalg.arrow import BLAS
from mocap_jax.linalg.arrow_solve import backward, forward
from mocap_jax.placement.options import ErrorModel
from mocap_jax.placement.rows import CONSTANTS, Boards, system_of
from mocap_jax.placement.scene import Scene


@dataclass(frozen=True)
class Posterior:
    """A factored information matrix."""

    factor: linalg.ArrowFactor
    coupling: Float[np.ndarray, "t nv m"]
    """U'^-1 B."""
    corner: Float[np.ndarray, "m m"]
    """Upper Cholesky factor of the Schur complement of the poses."""

    @property
    def log_determinant(self) -> float:
        """Of the whole matrix."""
        d = self.factor.block
        diagonal = np.concatenate(
            [np.diagonal(self.factor.panels[:, :d], axis1=1, axis2=2).ravel(), np.diag(self.corner)]
        )
        return 2.0 * float(np.log(np.abs(diagonal)).sum())

    def solve(
        self, x: Float[np.ndarray, "t nv p"], z: Float[np.ndarray, "m p"] | None = None
    ) -> tuple[Float[np.ndarray, "t nv p"], Float[np.ndarray, "m p"]]:
        """Solve for p right-hand sides of poses and (zero by default) constants."""
        t, d, p = x.shape
        y, flat = forward(self.factor, x), self.coupling.reshape(t * d, -1)
        reduced = -(flat.T @ y.reshape(t * d, p))
        if z is not None:
            reduced = reduced + z
        constants = lapack.dpotrs(self.corner, np.asfortranarray(reduced), lower=0)[0]
        rest = y - (flat @ constants).reshape(t, d, p)
        return backward(self.factor, rest), constants

    def root_solve(
        self, x: Float[np.ndarray, "t nv p"], z: Float[np.ndarray, "m p"]
    ) -> tuple[Float[np.ndarray, "t nv p"], Float[np.ndarray, "m p"]]:
        """L'^-1 (x, z) where the matrix is L L': white noise becomes posterior draws."""
        t, d, p = x.shape
        constants = blas.dtrsm(1.0, self.corner, np.asfortranarray(z), lower=0)
        flat = self.coupling.reshape(t * d, -1)
        return backward(self.factor, x - (flat @ constants).reshape(t, d, p)), constants


def posterior_of(scene: Scene, boards: Boards, errors: ErrorModel) -> Posterior:
    """Information of the priors and of all boards, factored.

    Raises:
        SolveError: the matrix is not positive definite.
    """
    t = scene.frames
    system = system_of(scene.body.topology, scene.kinematics, boards, errors)
    return factored(
        np.asarray(system.lower)[:t] + scene.prior.lower,
        np.swapaxes(np.asarray(system.border)[:t], 1, 2),
        board_corner(np.asarray(system.corner), errors),
    )


def factored(
    lower: Float[np.ndarray, "t 3 nv nv"],
    border: Float[np.ndarray, "t nv m"],
    corner: Float[np.ndarray, "m m"],
) -> Posterior:
    """Factor an information matrix; `lower` is overwritten.

    Raises:
        SolveError: the matrix is not positive definite.
    """
    with BLAS.limit(limits=1, user_api="blas"):
        factor = linalg.factor(lower, overwrite=True)
        coupling = forward(factor, border)
        flat = coupling.reshape(-1, coupling.shape[2])
        schur = np.asfortranarray(corner - flat.T @ flat)
        upper, info = lapack.dpotrf(schur, lower=0, clean=1)
    if info:
        raise SolveError("the constants of boards and sources are not determined")
    return Posterior(factor, coupling, upper)


def board_corner(own: Float[np.ndarray, "n 12 12"], errors: ErrorModel) -> Float[np.ndarray, "m m"]:
    """What data and priors say about the constants of boards alone."""
    n = len(own)
    out = np.zeros((n * CONSTANTS, n * CONSTANTS))
    prior = np.diag(constant_information(errors))
    for i in range(n):
        cells = slice(CONSTANTS * i, CONSTANTS * (i + 1))
        out[cells, cells] = own[i] + prior
    return out


def constant_information(errors: ErrorModel) -> Float[np.ndarray, "12"]:
    """Inverse variances of a board's constants."""
    c = errors.constants
    sigma = np.repeat(
        [c.gyroscope_bias_sigma, c.accelerometer_bias_sigma, c.mounting_sigma, c.offset_sigma], 3
    )
    return 1 / np.maximum(sigma, 1e-7) ** 2
