"""Biases that walk: piecewise linear between knots, by their steps from one knot to the next.

A random walk of density q has steps of standard deviation q sqrt(spacing), each independent of the
others. With steps over sqrt(spacing) as unknowns, and the mean over the recording as the constant
bias, priors are one number a kind and nothing couples them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError

# Border columns that walks may take in all: they cost what the square of their number does.
_MOST_COLUMNS = 1000


@dataclass(frozen=True)
class Walk:
    """What each unit step adds to a bias; columns are steps over sqrt(spacing)."""

    knots: Float[np.ndarray, "n+1"]
    """[s]"""
    at_frames: Float[np.ndarray, "t n"]
    """Zero in the mean over the frames. [sqrt(s)]"""
    at_knots: Float[np.ndarray, "n+1 n"]


def walk(time: Float[np.ndarray, "t"], steps: int) -> Walk:
    """Walk of so many equal steps from the first frame to the last."""
    time = np.asarray(time)
    knots = np.linspace(time[0], time[-1], steps + 1)
    spacing = knots[1] - knots[0]
    ramps = lambda at: np.clip((at[:, None] - knots[:-1]) / spacing, 0.0, 1.0)  # noqa: E731
    mean, root = ramps(time).mean(axis=0), np.sqrt(spacing)
    return Walk(knots, root * (ramps(time) - mean), root * (ramps(knots) - mean))


def number_of_steps(interval: float, duration: float, columns: int) -> int:
    """Steps of at most `interval` [s] in a recording; 0 for biases that stay.

    Args:
        interval: longest time between knots [s]; 0 for biases that stay.
        duration: of the recording [s].
        columns: border columns that each step takes.

    Raises:
        InputError: a negative interval, or one that takes more columns than can be afforded.
    """
    if interval < 0 or not np.isfinite(interval):
        raise InputError(f"bias_interval {interval:g}: must be 0 (constant biases) or more seconds")
    if not interval or not columns:
        return 0
    steps = max(1, int(np.ceil(duration / interval - 1e-6)))
    most = max(1, _MOST_COLUMNS // columns)
    if steps > most:
        raise InputError(
            f"bias_interval {interval:g}: {steps} steps in {duration:.1f} s are {steps * columns} "
            f"unknowns (most: {_MOST_COLUMNS}); valid: {np.ceil(10 * duration / most) / 10:g} s "
            "or more, 0 for constant biases"
        )
    return steps
