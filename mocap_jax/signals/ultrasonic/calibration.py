"""Offsets of sources from known distances (Vlasic 2007, section 4.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError


@dataclass(frozen=True)
class OffsetCalibration:
    """Offsets of s sources, and how well each distance is predicted by all the others."""

    offset: Float[np.ndarray, "s"]
    """Mean excess of measured over true distance [m]; NaN for sources without a measurement."""
    left_out_error: Float[np.ndarray, "n"]
    """Error of each distance when calibrated with the others of its source [m]; NaN where there
    is no other."""

    @property
    def mean_error(self) -> float:
        """Mean of the absolute left-out errors [m]; the paper reports 2.35 mm."""
        return float(np.nanmean(np.abs(self.left_out_error)))

    @property
    def error_deviation(self) -> float:
        """Standard deviation of the absolute left-out errors [m]; the paper reports 1.92 mm."""
        return float(np.nanstd(np.abs(self.left_out_error)))


def calibrate_offsets(
    measured: Float[np.ndarray, "n"],
    true: Float[np.ndarray, "n"],
    source: np.ndarray,
    sources: int,
) -> OffsetCalibration:
    """Estimate each source's offset.

    Args:
        measured: distances without offset correction [m].
        true: the same, measured by other means [m].
        source: index of each distance's source.
        sources: their number.

    Raises:
        InputError: lengths differ, a value is not finite, an index is out of range.
    """
    excess = np.asarray(measured, np.float64) - np.asarray(true, np.float64)
    index = np.asarray(source)
    if excess.shape != index.shape or excess.ndim != 1:
        raise InputError("measured, true and source must be equally long lists")
    if not np.isfinite(excess).all():
        raise InputError(f"{np.count_nonzero(~np.isfinite(excess))} distances are not finite")
    if index.size and not (0 <= index.min() and index.max() < sources):
        raise InputError(f"source {index.max()}: valid are 0 to {sources - 1}")
    count = np.bincount(index, minlength=sources).astype(np.float64)
    total = np.bincount(index, excess, minlength=sources)
    offset = np.divide(total, count, out=np.full(sources, np.nan), where=count > 0)
    others = np.divide(
        total[index] - excess, count[index] - 1.0,
        out=np.full(len(excess), np.nan), where=count[index] > 1,
    )  # fmt: skip
    return OffsetCalibration(offset, excess - others)
