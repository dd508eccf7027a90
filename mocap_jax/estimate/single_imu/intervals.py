"""A recording cut into intervals between knots, and which of them are still."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax.errors import InputError
from mocap_jax.estimate.single_imu.options import SingleImuOptions
from mocap_jax.recording import InertialStream
from mocap_jax.residuals.preintegration import Samples

# Steps of a uniform recording differ by less than this share of one.
_UNIFORM = 0.2
# Missing samples are bridged by straight lines over at most this long [s].
_BRIDGE = 0.05


def checked(
    stream: InertialStream,
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"], float]:
    """Rates, forces and the step [s], short gaps bridged.

    Raises:
        InputError: too short, not uniform in time, or gaps that are too long.
    """
    time = np.asarray(stream.time, float)
    if len(time) < 2:
        raise InputError(f"an inertial stream of {len(time)} samples: needs at least 2")
    step = float((time[-1] - time[0]) / (len(time) - 1))
    if not step > 0 or np.abs(np.diff(time) - step).max() > _UNIFORM * step:
        raise InputError("the inertial stream's samples are not at equal distances in time")
    rate = _bridged(np.asarray(stream.gyroscope, float), step, "gyroscope")
    force = _bridged(np.asarray(stream.accelerometer, float), step, "accelerometer")
    return rate, force, step


def _bridged(values: np.ndarray, step: float, name: str) -> np.ndarray:
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    if len(known) == len(values):
        return values
    edges = np.concatenate([[-1], known, [len(values)]])
    longest = (np.diff(edges).max() - 1) * step
    if not len(known) or longest > _BRIDGE:
        raise InputError(f"{name}: samples are missing for {longest:.2f} s (at most {_BRIDGE} s)")
    at = np.arange(len(values))
    return np.stack([np.interp(at, known, column[known]) for column in values.T], axis=1)


def cut(
    rate: Float[np.ndarray, "n 3"], force: Float[np.ndarray, "n 3"], step: float, count: int
) -> Samples:
    """Samples (k, count + 1, 3) of intervals of `count` samples, the last one padded."""
    intervals = -(-len(rate) // count)
    index = np.arange(count + 1) + count * np.arange(intervals)[:, None]
    padding = intervals * count - len(rate)

    def rows(x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[:1], x, np.repeat(x[-1:], padding, axis=0)])[index]

    steps = np.full(intervals * count, step)
    steps[len(rate) :] = 0.0
    return Samples(rows(rate), rows(force), steps.reshape(intervals, count))


def still_intervals(samples: Samples, options: SingleImuOptions) -> Bool[np.ndarray, "k"]:
    """Intervals in which the sensor lies still."""
    rate, force, real = samples.rate[:, 1:], samples.force[:, 1:], samples.step > 0
    quiet = np.array([
        r[m].std(axis=0).max() < options.still_rate
        and f[m].std(axis=0).max() < options.still_force
        and np.abs(r[m].mean(axis=0)).max() < options.still_bias
        for r, f, m in zip(rate, force, real, strict=True)
    ])  # fmt: skip
    return long_runs(quiet, options.still_intervals)


def long_runs(flags: Bool[np.ndarray, "k"], least: int) -> Bool[np.ndarray, "k"]:
    """Only the runs of True of at least this length."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    out = np.zeros(len(flags), bool)
    for first, after in edges.reshape(-1, 2):
        out[first:after] = after - first >= least
    return out


def still_bias(samples: Samples, still: Bool[np.ndarray, "k"]) -> Float[np.ndarray, "3"]:
    """Mean rate of the still intervals; zero without any."""
    if not still.any():
        return np.zeros(3)
    chosen = samples.rate[still, 1:].reshape(-1, 3)
    return chosen[(samples.step[still] > 0).ravel()].mean(axis=0)
