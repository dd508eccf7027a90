"""First-order Gauss-Markov processes: errors that wander and come back."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter


def gauss_markov(
    time: Float[np.ndarray, "n"],
    deviation: float | Float[np.ndarray, "3"],
    correlation_time: float,
    rng: np.random.Generator,
) -> Float[np.ndarray, "n 3"]:
    """Three independent processes, stationary from the first sample on.

    Args:
        time: uniform [s].
        deviation: standard deviation, of all or of each.
        correlation_time: after which the correlation has fallen to 1/e [s].
        rng: random stream.
    """
    kept = np.exp(-(time[1] - time[0]) / correlation_time)
    drive = rng.standard_normal((len(time), 3))
    drive[1:] *= np.sqrt(1 - kept**2)
    return deviation * lfilter([1.0], [1.0, -kept], drive, axis=0)
