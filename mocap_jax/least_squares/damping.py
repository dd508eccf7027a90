"""What Levenberg-Marquardt adds to the normal equations of a sequence.

Plain damping makes every change expensive. What leaves the range of a linearisation here is jitter:
accelerations are second differences of positions, so that the square of a step that alternates from
frame to frame is magnified by 1/h^2 against sensors that are precise to 0.02 m/s^2. A change that
is smooth in time, such as a joint's constant offset, is harmless and may be large. Therefore the
second difference of the step is damped, and the step itself only a little, which keeps the
equations regular. Unknowns that only linear terms hold (joints beyond the last sensor) need none.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

# Of the damping, what falls on the step itself (and on constants).
_ON_THE_STEP = 1e-6
# Largest eigenvalue of the second difference's square.
_LARGEST = 16.0


def smooth_in_time(frames: int, half_bandwidth: int) -> bool:
    """Whether a sequence has second differences that its band can hold; else all is damped."""
    return frames >= 3 and half_bandwidth >= 2


def on_the_step(damping: float, frames: int, half_bandwidth: int) -> float:
    """The part of the damping that falls on each unknown."""
    return damping * (_ON_THE_STEP if smooth_in_time(frames, half_bandwidth) else 1.0)


def damp_jitter(
    lower: Float[np.ndarray, "t b+1 d d"],
    damping: float | Float[np.ndarray, "d"],
    rows: slice = slice(None),
) -> None:
    """Add the damping of second differences to the lower blocks of some frames of J'J, in place.

    Args:
        lower: blocks of all frames.
        damping: one figure, or one for each unknown of a frame.
        rows: the frames.
    """
    frames, width, size, _ = lower.shape
    if not smooth_in_time(frames, width - 1):
        return
    diagonal = np.arange(size)
    gram = np.zeros((3, frames))
    for i, a in enumerate((1.0, -2.0, 1.0)):
        for j, b in enumerate((1.0, -2.0, 1.0)[: i + 1]):
            gram[i - j, j : frames - 2 + j] += a * b
    for offset in range(3):
        lower[rows, offset, diagonal, diagonal] += gram[offset, rows, None] * damping / _LARGEST


def jitter_force(
    step: Float[np.ndarray, "t d"],
    damping: float | Float[np.ndarray, "d"],
    half_bandwidth: int,
) -> Float[np.ndarray, "t d"]:
    """That part of the damping matrix times a step."""
    out = np.zeros_like(step)
    if smooth_in_time(len(step), half_bandwidth):
        second = np.diff(step, 2, axis=0) * damping / _LARGEST
        out[:-2] += second
        out[1:-1] -= 2 * second
        out[2:] += second
    return out
