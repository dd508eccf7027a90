"""How wrong measurements may be: declared noise, and model errors that grow with the motion.

What limits a body-worn board is not its white noise. It lags and wobbles on soft tissue and its
clock is off: an error of timing, which turns jerk into wrong acceleration and angular acceleration
into wrong rate. A wrong lever arm adds its own share of the angular motion. In a quiet moment the
same board is as good as its bias. Weights that do not tell the two apart let fast motion, where
errors repeat with the motion, outvote the rest and bend the sensors' constants.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.ndimage import uniform_filter1d

from mocap_jax.estimate.whole_sequence_options import NoiseOptions
from mocap_jax.measurement import FrameData
from mocap_jax.recording import NoiseFigures

# Errors outlast the motion that causes them (tissue rings): window of local mean squares [s].
_MEMORY = 0.2

Variances = dict[str, tuple[np.ndarray, np.ndarray]]
"""Kind -> variances per residual of declared noise (inf where absent) and of model errors."""


def variances(
    data: FrameData,
    force: Float[np.ndarray, "t s 3"],
    mean_rate: Float[np.ndarray, "t s 3"],
    noise: NoiseFigures,
    model: NoiseOptions,
) -> Variances:
    """Variances of all measurements.

    Args:
        data: measurements on the frame grid.
        force: specific forces as the residuals use them, NaN where missing.
        mean_rate: rates likewise.
        noise: declared.
        model: sizes of the model errors.
    """
    valid = _complete(force)
    around = np.zeros_like(valid)
    around[1:-1] = valid[:-2] & valid[1:-1] & valid[2:]
    step, weight = float(data.step), np.asarray(data.range_weight)
    jerk = _local_square(_slope(data.accelerometer, step, noise.accelerometer), step)
    turn = _local_square(_slope(data.gyroscope, step, noise.gyroscope), step)
    spin = np.nan_to_num((np.asarray(data.gyroscope) ** 2).sum(-1))
    arm = model.lever_arm_sigma**2 * (turn + _local_square(spin**2, step))
    acceleration = model.accelerometer_model**2 + arm + model.lag**2 * jerk
    rate = model.gyroscope_model**2 + model.lag**2 * turn
    full = np.ones(valid.shape)
    return {
        "accelerometer": (_declared(around, noise.accelerometer**2), acceleration),
        "gyroscope": (_declared(_complete(mean_rate), noise.gyroscope**2), rate),
        "orientation": (
            _declared(_complete(np.asarray(data.orientation)), noise.orientation**2),
            model.orientation_model**2 * full,
        ),
        "range": (
            _declared(weight > 0, noise.range**2 / np.maximum(weight, 1e-6) ** 2),
            model.range_model**2 * np.ones_like(weight),
        ),
    }


def _complete(values: np.ndarray) -> np.ndarray:
    """Where a row of values is complete."""
    return np.isfinite(values).all(axis=-1)


def _declared(present: np.ndarray, variance: float | np.ndarray) -> np.ndarray:
    return np.where(present, variance, np.inf)


def _slope(samples: object, step: float, noise: float) -> Float[np.ndarray, "t s"]:
    """Squared time derivative of readings, less what their noise alone makes."""
    values = np.array(samples)
    t = np.arange(len(values))
    for series in values.reshape(len(values), -1).T:
        known = np.isfinite(series)
        if known.any():
            series[~known] = np.interp(t[~known], t[known], series[known])
    squared = (np.gradient(np.nan_to_num(values), step, axis=0) ** 2).sum(-1)
    # One-sided differences of the end frames are noisier: the frames beside them stand in.
    squared[[0, -1]] = squared[[1, -2]]
    return squared - 3 * noise**2 / (2 * step**2)


def _local_square(squared: np.ndarray, step: float) -> np.ndarray:
    """Mean of squares around each frame, not negative."""
    frames = 2 * round(_MEMORY / (2 * step)) + 1
    return np.maximum(uniform_filter1d(squared, frames, axis=0, mode="nearest"), 0.0)
