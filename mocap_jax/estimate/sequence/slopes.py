"""Time derivatives of readings, for boards whose clocks are off."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

# A cubic through so many samples (Savitzky and Golay 1964, Anal. Chem. 36, 1627-1639) has half the
# noise of a central difference of fourth order, and is as good up to a tenth of the sampling rate.
_SAMPLES, _ORDER = 7, 3
# Window of the mean squares that tell motion from noise [s], and how far these scatter by chance.
_WINDOW, _CHANCE = 0.5, 1.5


def slopes(
    values: Float[np.ndarray, "t s 3"], step: float, noise: float
) -> tuple[Float[np.ndarray, "t s 3"], Float[np.ndarray, "t s 3"]]:
    """First and second time derivative; gaps (NaN) are bridged smoothly.

    Both are what is to be expected of the truth given noisy ones (Carroll et al. 2006, Measurement
    Error in Nonlinear Models, chapter 4: regression calibration), less by the noise's share of
    their mean square around a frame. Else noise would say, while nobody moves, that no clock is
    off.

    Args:
        values: readings on the frame grid.
        step: between frames [s].
        noise: standard deviation of a reading's component.
    """
    # It takes a third of a second to import.
    from scipy.ndimage import uniform_filter1d
    from scipy.signal import savgol_coeffs, savgol_filter

    whole = np.array(values, float)
    if len(whole) < _SAMPLES:
        return np.zeros_like(whole), np.zeros_like(whole)
    for series in whole.reshape(len(whole), -1).T:
        _bridge(series)
    first, second = (
        savgol_filter(whole, _SAMPLES, _ORDER, deriv=n, delta=step, axis=0) for n in (1, 2)
    )
    chance = np.linalg.norm(savgol_coeffs(_SAMPLES, _ORDER, deriv=1, delta=step)) * noise
    around = 2 * round(_WINDOW / (2 * step)) + 1
    # Noisier at the ends, where no samples are on the other side: their neighbours stand in.
    end = _SAMPLES // 2
    inner = np.pad((first[end:-end] ** 2).sum(-1), ((end, end), (0, 0)), mode="edge")
    square = uniform_filter1d(inner, around, axis=0, mode="nearest")
    share = 1 - _CHANCE * 3 * chance**2 / np.maximum(square, 1e-12 + 3 * chance**2)
    kept = np.clip(share, 0.0, 1.0)[..., None]
    return kept * first, kept * second


def _bridge(series: Float[np.ndarray, "t"]) -> None:
    """Fill gaps in place by a cubic spline; before the first and after the last value, by these."""
    from scipy.interpolate import CubicSpline

    known = np.isfinite(series)
    t = np.arange(len(series))
    if known.all():
        return
    if known.sum() < 2:
        series[:] = 0.0
        return
    inside = t.clip(t[known][0], t[known][-1])
    series[~known] = CubicSpline(t[known], series[known])(inside[~known])
