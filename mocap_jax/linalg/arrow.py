"""Block-banded ("arrow") normal equations on the host, and how they are factored.

The matrix is block-banded in time with a dense border of constant unknowns,

    [ H   B ]      H: t x t blocks of size d, half-bandwidth b (in blocks)
    [ B' C  ]      B: t blocks of size d x m;  C: m x m

and is factored as H = U'U frame by frame with BLAS-3 calls (left-looking), the Schur complement
C - B'H^-1 B being accumulated on the way. U'^-1 B, as large as H itself, is not kept: who needs it
again has it recomputed, a stretch of frames at a time, from the few blocks kept in between.

Layout: a JAX array of blocks in C order is, read as Fortran order, its transpose. So row-stacked
lower blocks `(t, (b+1) d, d)` become column-stacked upper blocks `d x (b+1) d` without a copy.
Many small BLAS calls on two busy threads are far slower than on one: threads are limited here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from scipy.linalg import blas, lapack
from threadpoolctl import ThreadpoolController

from mocap_jax.errors import SolveError

# Frames between the blocks of U'^-1 B that are kept.
STRETCH = 128

# Looking for the libraries takes a millisecond: once, after SciPy has loaded them.
BLAS = ThreadpoolController()

BorderBlocks = Callable[[int], np.ndarray]
"""Frame index -> that frame's block of B', shape (m, d), C order."""


@runtime_checkable
class BorderProducts(Protocol):
    """Border blocks whose products with vectors are cheaper than the blocks themselves."""

    def times(self, z: np.ndarray) -> np.ndarray:
        """B z, (t, d)."""
        ...

    def pulled(self, x: np.ndarray) -> np.ndarray:
        """B'x, (m,)."""
        ...


@dataclass(frozen=True)
class ArrowFactor:
    """Cholesky factor of an arrow matrix."""

    panels: np.ndarray
    """(t, (b + 1) d, d): blocks U_kk', U_k(k+1)', ..., U_k(k+b)' of each frame."""
    corner: np.ndarray
    """(m, m) upper Cholesky factor of the Schur complement C - B'H^-1 B."""
    kept: tuple[list[np.ndarray], ...] = ()
    """At the start of every stretch of frames, the blocks of U'^-1 B just before it (latest
    first), each d x m; empty without a border."""
    stretch: int = STRETCH
    """Frames from one of these to the next."""
    damping: float = 0.0
    """What was added to the diagonals of H and C."""

    @property
    def frames(self) -> int:
        return self.panels.shape[0]

    @property
    def block(self) -> int:
        return self.panels.shape[2]

    @property
    def half_bandwidth(self) -> int:
        return self.panels.shape[1] // self.block - 1


class Factoring:
    """A factorisation under way: frames are factored as soon as their blocks are known."""

    def __init__(
        self,
        lower: np.ndarray,
        border: BorderBlocks | None = None,
        *,
        damping: float = 0.0,
        overwrite: bool = False,
    ) -> None:
        """Arguments as for `factor`; rows of `lower` may be filled in later if `overwrite`."""
        t, width, d, _ = lower.shape
        self.done = 0
        """Frames factored so far."""
        self._panels = (lower if overwrite else lower.copy()).reshape(t, width * d, d)
        self._border, self._damping = border, damping
        self._schur = np.zeros((0, 0))
        """- B'H^-1 B over these frames."""
        self._recent: list[np.ndarray] = []
        self._kept: list[list[np.ndarray]] = []

    def advance(self, stop: int) -> None:
        """Factor the frames before `stop`.

        Raises:
            SolveError: the matrix is not positive definite; the text says where.
        """
        t, rows, d = self._panels.shape
        b, diagonal = rows // d - 1, np.arange(d)
        with BLAS.limit(limits=1, user_api="blas"):
            for k in range(self.done, stop):
                self._panels[k, diagonal, diagonal] += self._damping
                upper = self._panels[k].T
                _eliminate_earlier(self._panels, k, b, d, upper)
                _, info = lapack.dpotrf(upper[:, :d], lower=0, clean=1, overwrite_a=1)
                if info:
                    raise SolveError(f"the normal equations are singular at frame {k} of {t}")
                inverse = _inverse(upper[:, :d])
                blas.dtrmm(1.0, inverse, upper[:, d:], trans_a=1, overwrite_b=1)
                if self._border is not None:
                    self._eliminate_border(k, b, d, self._border(k), inverse)
        self.done = max(stop, self.done)

    def _eliminate_border(
        self, k: int, b: int, d: int, block: np.ndarray, inverse: np.ndarray
    ) -> None:
        if k % STRETCH == 0:
            self._kept.append(self._recent)
        if not len(self._schur):
            self._schur = np.zeros((len(block), len(block)), order="F")
        eliminated = eliminate_border(self._panels, k, b, d, block, self._recent, inverse)
        self._schur = blas.dsyrk(
            -1.0, eliminated, 1.0, self._schur, trans=1, lower=0, overwrite_c=1
        )
        self._recent = [eliminated, *self._recent[: b - 1]]

    def finish(self, corner: np.ndarray | None = None) -> ArrowFactor:
        """Factor what is left.

        Raises:
            SolveError: as `advance`, or the constants are not determined.
        """
        self.advance(len(self._panels))
        if corner is None or not len(corner):
            return ArrowFactor(self._panels, np.zeros((0, 0)), damping=self._damping)
        schur = corner + self._damping * np.eye(len(corner))
        if self._border is not None:
            schur += self._schur
        chol, info = lapack.dpotrf(schur, lower=0, clean=1)
        if info:
            raise SolveError("the data do not determine the constant unknowns (singular border)")
        return ArrowFactor(self._panels, chol, tuple(self._kept), STRETCH, self._damping)


def factor(
    lower: np.ndarray,
    corner: np.ndarray | None = None,
    border: BorderBlocks | None = None,
    *,
    damping: float = 0.0,
    overwrite: bool = False,
) -> ArrowFactor:
    """Factor an arrow matrix.

    Args:
        lower: (t, b + 1, d, d), C order; `lower[k, o]` is block (k + o, k) of H. Blocks past the
            last frame are ignored.
        corner: (m, m), C; None without a border.
        border: blocks of B' by frame; None without a border.
        damping: added to the diagonal of H and of C.
        overwrite: let the factor use the memory of `lower`.

    Raises:
        SolveError: the matrix is not positive definite; the text says where.
    """
    return Factoring(lower, border, damping=damping, overwrite=overwrite).finish(corner)


def _eliminate_earlier(panels: np.ndarray, k: int, b: int, d: int, target: np.ndarray) -> None:
    """Subtract from frame k's blocks, in place, what the b frames before it contribute."""
    for j in range(1, min(b, k) + 1):
        earlier = panels[k - j].T
        own, later = earlier[:, j * d : (j + 1) * d], earlier[:, (j + 1) * d :]
        # The factorisation reads the upper triangle of the diagonal block alone.
        blas.dsyrk(-1.0, own, 1.0, target[:, :d], trans=1, lower=0, overwrite_c=1)
        if later.size:
            part = target[:, d : (b + 1 - j) * d]
            blas.dgemm(-1.0, own, later, 1.0, part, trans_a=1, overwrite_c=1)


def _inverse(upper: np.ndarray) -> np.ndarray:
    """Of an upper triangle: multiplying by it is twice as fast as solving for many columns."""
    return lapack.dtrtri(upper, lower=0)[0]


def eliminate_border(
    panels: np.ndarray,
    k: int,
    b: int,
    d: int,
    block: np.ndarray,
    recent: list[np.ndarray],
    inverse: np.ndarray | None = None,
) -> np.ndarray:
    """Block k of U'^-1 B, given those of the frames just before (latest first).

    `inverse` is that of U_kk, if it is at hand.
    """
    out = np.array(block, float).T  # other types would be copied, and the copy thrown away
    for j, earlier in enumerate(recent[:b], start=1):
        coupling = panels[k - j].T[:, j * d : (j + 1) * d]
        blas.dgemm(-1.0, coupling, earlier, 1.0, out, trans_a=1, overwrite_c=1)
    inverse = _inverse(panels[k].T[:, :d]) if inverse is None else inverse
    return blas.dtrmm(1.0, inverse, out, trans_a=1, overwrite_b=1)
