"""Linear algebra of whole-sequence problems."""

from mocap_jax.linalg.arrow import ArrowFactor, BorderBlocks, Factoring, factor
from mocap_jax.linalg.arrow_solve import (
    backward,
    corner_covariance,
    forward,
    sample,
    solve,
    solve_banded,
    solve_corner,
)
from mocap_jax.linalg.marginals import marginals, pair_marginals
from mocap_jax.linalg.refine import refine, shifted_factor
from mocap_jax.linalg.scan import ScanFactor, scan_factor, scan_solve

__all__ = [
    "ArrowFactor", "BorderBlocks", "Factoring", "ScanFactor", "backward", "corner_covariance",
    "factor", "forward", "marginals", "pair_marginals", "refine", "sample", "scan_factor",
    "scan_solve", "shifted_factor", "solve", "solve_banded", "solve_corner",
]  # fmt: skip
