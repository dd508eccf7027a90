"""Where readings hold steady: still positions, and a turntable at its speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class SteadyOptions:
    """What counts as steady."""

    block_s: float = 0.25
    """Readings are judged in blocks of this length [s]."""
    shortest_s: float = 1.0
    """Shorter intervals are passed over [s]."""
    noise_factor: float = 3.0
    """Noisy sensors may deviate by this many times what they do in their quietest fifth."""


def steady_intervals(
    time: Float[np.ndarray, "n"],
    values: Float[np.ndarray, "n c"],
    allowed: Float[np.ndarray, "c"],
    options: SteadyOptions,
) -> list[slice]:
    """Unbroken stretches of samples whose readings hold steady, without their first and last block.

    A block is steady where every channel's standard deviation is at most what is allowed, or a few
    times its own noise; blocks belong together where their means agree as well. Slow drift is no
    step.

    Args:
        time: of the samples, rising [s].
        values: readings; NaN where one is missing.
        allowed: standard deviation of each channel, in its unit.
        options: lengths.
    """
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    size = max(int(round(options.block_s / step)), 4)
    count = len(time) // size
    if count == 0:
        return []
    blocks = values[: count * size].reshape(count, size, -1)
    mean, deviation = _moments(blocks)
    limit = _limits(deviation, allowed, options)
    steady = (deviation <= limit).all(axis=1)
    start, end = time[: count * size : size], time[size - 1 : count * size : size]
    together = (np.abs(np.diff(mean, axis=0)) <= limit).all(axis=1)
    together &= (start[1:] - end[:-1]) < options.block_s
    # Stamps are rounded to nanoseconds: a thousandth of a block less is not one block more.
    least = max(int(np.ceil(options.shortest_s / (size * step) - 1e-3)), 1)
    return [
        slice((first + 1) * size, (last - 1) * size)
        for first, last in _runs(steady, together)
        if last - first - 2 >= least
    ]


def _moments(blocks: Float[np.ndarray, "b s c"]) -> tuple[np.ndarray, np.ndarray]:
    """Mean and deviation of each block; infinite where less than half of it was measured."""
    known = np.isfinite(blocks)
    number = known.sum(axis=1)
    filled = np.where(known, blocks, 0.0)
    mean = filled.sum(axis=1) / np.maximum(number, 1)
    square = np.where(known, (blocks - mean[:, None]) ** 2, 0.0).sum(axis=1)
    deviation = np.sqrt(square / np.maximum(number - 1, 1))
    return mean, np.where(2 * number >= blocks.shape[1], deviation, np.inf)


def _limits(
    deviation: Float[np.ndarray, "b c"], allowed: Float[np.ndarray, "c"], options: SteadyOptions
) -> Float[np.ndarray, "c"]:
    limits = np.array(allowed, np.float64)
    for c, column in enumerate(deviation.T):
        known = column[np.isfinite(column)]
        if known.size:
            quiet = options.noise_factor * float(np.quantile(known, 0.2))
            # What moves all the time is not noisy but moving.
            limits[c] = max(limits[c], min(quiet, 5.0 * limits[c]))
    return limits


def _runs(steady: np.ndarray, together: np.ndarray) -> list[tuple[int, int]]:
    """First and behind-the-last block of all runs of steady blocks that belong together."""
    runs: list[tuple[int, int]] = []
    first: int | None = None
    for k, good in enumerate(steady):
        if first is not None and (not good or not together[k - 1]):
            runs.append((first, k))
            first = None
        if good and first is None:
            first = k
    if first is not None:
        runs.append((first, len(steady)))
    return runs
