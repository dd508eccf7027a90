"""Which points of the feet stand on the ground, frame by frame.

Two sources, of which either suffices:

- a board on the foot itself: still by the generalised likelihood ratio of zero velocity (Skog et
  al. 2010, IEEE Trans. Biomed. Eng. 57, 2657-2666): over a window, specific force is gravity in
  one direction and rate is zero. It needs no estimate, and sees feet that are flat.
- the estimated motion: a point whose velocity neither is high nor changes. This uses boards on the
  shanks, and all others. What the free root drifts by is common to all points and changes slowly;
  it is taken off first, since velocity would not tell standing from moving without that.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing, binary_opening, uniform_filter1d

from mocap_jax.body import Body, site_segments
from mocap_jax.estimate.contact.feet import Feet
from mocap_jax.estimate.contact.options import ContactOptions
from mocap_jax.measurement import FrameData

_GRAVITY = 9.81
# Time over which the drift of a free root's velocity hardly changes [s].
_DRIFT_TIME = 2.0
# Rounds of finding the drift from points that stand, and which points stand.
_ROUNDS = 3


def standing_boards(
    data: FrameData, body: Body, feet: Feet, options: ContactOptions
) -> Bool[np.ndarray, "t p"]:
    """Points on feet whose own board is still; nothing for feet without a board.

    Args:
        data: measurements on the frame grid.
        body: whose sites carry the boards.
        feet: points of the soles.
        options: thresholds.
    """
    out = np.zeros((len(data.time), len(feet.bodies)), bool)
    width = _width(options.window, float(data.step))
    segments = site_segments(body.topology)
    for i, site in enumerate(data.sites):
        own = np.array(feet.bodies) == segments[site]
        force, rate = (np.asarray(x)[:, i] for x in (data.accelerometer, data.gyroscope))
        if own.any() and np.isfinite(force).any() and np.isfinite(rate).any():
            out[:, own] |= _still(force, rate, width, options)[:, None]
    return out


def _still(
    force: Float[np.ndarray, "t 3"], rate: Float[np.ndarray, "t 3"], width: int,
    options: ContactOptions,
) -> Bool[np.ndarray, "t"]:  # fmt: skip
    """Frames in whose window a board feels gravity and no turn; missing readings are not still."""
    known = np.isfinite(force).all(1) & np.isfinite(rate).all(1)
    force, rate = np.where(known[:, None], force, 0.0), np.where(known[:, None], rate, 0.0)
    mean = uniform_filter1d(force, width, axis=0, mode="nearest")
    up = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
    # Sum over the window of |f - g up|^2, with the window's own direction.
    apart = uniform_filter1d((force**2).sum(1), width, mode="nearest")
    apart += _GRAVITY**2 - 2 * _GRAVITY * (mean * up).sum(1)
    turning = uniform_filter1d((rate**2).sum(1), width, mode="nearest")
    ratio = apart / options.acceleration**2 + turning / options.turn**2
    return _tidied((ratio < 1.0) & known, width)


def standing_points(
    position: Float[np.ndarray, "t p 3"], step: float, options: ContactOptions, *, drifts: bool
) -> Bool[np.ndarray, "t p"]:
    """Points that stand in an estimated motion.

    Args:
        position: of the points in the world [m].
        step: between frames [s].
        options: thresholds.
        drifts: nothing measures the root, so that its velocity drifts.
    """
    width = _width(options.window, step)
    velocity = uniform_filter1d(np.gradient(position, step, axis=0), width, axis=0, mode="nearest")
    steady = _speed(np.gradient(velocity, step, axis=0)) < options.acceleration
    drift = np.zeros((len(position), 1, 3))
    standing = steady & (_speed(velocity) < options.fastest)
    if drifts:
        drift = _first_drift(velocity, steady, step)
        for _ in range(_ROUNDS):
            standing = steady & (_speed(velocity - drift) < options.fastest)
            drift = _mean_velocity(velocity, standing, drift, step)
        standing = steady & (_speed(velocity - drift) < options.fastest)
    return _tidied(standing, width)


def _speed(velocity: Float[np.ndarray, "t p 3"]) -> Float[np.ndarray, "t p"]:
    return np.linalg.norm(velocity, axis=-1)


def _first_drift(
    velocity: Float[np.ndarray, "t p 3"], steady: Bool[np.ndarray, "t p"], step: float
) -> Float[np.ndarray, "t 1 3"]:
    """Median velocity of steady points around each time: most of them stand."""
    half = max(1, round(_DRIFT_TIME / step / 2))
    out = np.zeros((len(velocity), 1, 3))
    centres = np.arange(0, len(velocity), max(1, half // 4))
    medians = []
    for k in centres:
        rows = slice(max(0, k - half), k + half + 1)
        chosen = velocity[rows][steady[rows]]
        medians.append(np.median(chosen, axis=0) if len(chosen) else np.zeros(3))
    for axis in range(3):
        out[:, 0, axis] = np.interp(np.arange(len(velocity)), centres, np.array(medians)[:, axis])
    return out


def _mean_velocity(
    velocity: Float[np.ndarray, "t p 3"], standing: Bool[np.ndarray, "t p"],
    before: Float[np.ndarray, "t 1 3"], step: float,
) -> Float[np.ndarray, "t 1 3"]:  # fmt: skip
    """Mean velocity of standing points around each time; as before where none stands."""
    width = _width(_DRIFT_TIME / 2, step)
    total = (velocity * standing[..., None]).sum(1)
    count = standing.sum(1)[:, None].astype(float)
    total, count = (uniform_filter1d(x, width, axis=0, mode="nearest") for x in (total, count))
    mean = total / np.maximum(count, 1e-9)
    return np.where(count > 1e-6, mean, before[:, 0])[:, None]


def _width(duration: float, step: float) -> int:
    """Odd number of frames."""
    return 2 * max(1, round(duration / step / 2)) + 1


def _tidied(standing: Bool[np.ndarray, "t *p"], width: int) -> Bool[np.ndarray, "t *p"]:
    """Without gaps and contacts shorter than a window."""
    line = np.ones((width, *(1,) * (standing.ndim - 1)), bool)
    padding = [(width, width), *[(0, 0)] * (standing.ndim - 1)]
    padded = np.pad(standing, padding, mode="edge")
    return binary_opening(binary_closing(padded, line), line)[width:-width]
