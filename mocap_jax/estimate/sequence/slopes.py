"""Time derivatives of readings, for boards whose clocks are off."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

# A cubic through so many samples (Savitzky and Golay 1964, Anal. Chem. 36, 1627-1639) has half the
# noise of a central difference of fourth order, and is as good up to a tenth of the sampling rate.
_SAMPLES, _ORDER = 7, 3


def slopes(
    values: Float[np.ndarray, "t s 3"], step: float
) -> tuple[Float[np.ndarray, "t s 3"], Float[np.ndarray, "t s 3"]]:
    """First and second time derivative; gaps (NaN) are bridged by straight lines.

    Args:
        values: readings on the frame grid.
        step: between frames [s].
    """
    # It takes a third of a second to import.
    from scipy.signal import savgol_filter

    whole = np.array(values, float)
    if len(whole) < _SAMPLES:
        return np.zeros_like(whole), np.zeros_like(whole)
    t = np.arange(len(whole))
    for series in whole.reshape(len(whole), -1).T:
        known = np.isfinite(series)
        series[~known] = np.interp(t[~known], t[known], series[known]) if known.any() else 0.0
    first, second = (
        savgol_filter(whole, _SAMPLES, _ORDER, deriv=n, delta=step, axis=0) for n in (1, 2)
    )
    return first, second
