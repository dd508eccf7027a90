"""Zero and slope of three axes from readings of a vector of known length in several directions.

Six positions give zero and slope of each axis at once: the mean and half the difference of its two
readings (Vlasic 2007, section 4.3). That takes every axis for exactly upright; a board that leans
by 3 degrees reads 0.14 % less. Length tells more than direction: all positions together determine
zeros and slopes without any word about how they were held, as long as the axes are square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.calibration.plateau import DIRECTIONS, Plateau
from mocap_jax.recording import AxisCalibration
from mocap_jax.recording.calibration import triple

_ITERATIONS = 20


@dataclass(frozen=True)
class AxisFit:
    """Zero and slope of a sensor's axes, and what speaks for them."""

    calibration: AxisCalibration
    cross_axis: Float[np.ndarray, "3 3"]
    """Response of axis i to the vector along axis j, as a share of the vector; the diagonal holds
    the slopes of axes taken for upright. Off it, skewed axes and leaning positions add up."""
    residual: float
    """RMS of length less the known one over all positions [m/s^2 or rad/s]; 0 for six."""
    plateaus: tuple[Plateau, ...]


def missing_directions(plateaus: list[Plateau]) -> tuple[str, ...]:
    """Directions that no plateau is along."""
    found = {p.direction for p in plateaus}
    return tuple(d for d in DIRECTIONS if d not in found)


def fit_axes(plateaus: list[Plateau], length: float, length_sigma: float = 0.0) -> AxisFit:
    """Zeros and slopes from plateaus along all six directions.

    Args:
        plateaus: readings of a vector of one length; none of the six directions may be missing.
        length: of that vector [m/s^2 or rad/s].
        length_sigma: its relative standard deviation, common to all plateaus.
    """
    readings = np.array([p.mean for p in plateaus])
    sigma = np.maximum(np.array([p.sigma for p in plateaus]), 1e-12)
    response, zero = _upright(plateaus, length)
    x = np.concatenate([zero, np.diag(response)])
    weight, inverse = np.ones(len(readings)), np.eye(6)
    for _ in range(_ITERATIONS):
        miss, slope, towards = _length_error(x, readings, length)
        weight = 1.0 / np.einsum("kc,kc->k", (towards / x[3:]) ** 2, sigma**2)
        inverse = np.linalg.inv(slope.T @ (slope * weight[:, None]))
        step = inverse @ (slope.T @ (weight * miss))
        x = x - step
        if np.abs(step).max() < 1e-13 * length:
            break
    miss, _, _ = _length_error(x, readings, length)
    spread = _spread(miss, weight)
    deviation = np.sqrt(np.diag(inverse)) * spread
    deviation[3:] = np.hypot(deviation[3:], x[3:] * length_sigma)
    calibration = AxisCalibration(
        zero=triple(x[:3]), slope=triple(x[3:]),
        zero_sigma=triple(deviation[:3]), slope_sigma=triple(deviation[3:]),
    )  # fmt: skip
    return AxisFit(calibration, response, float(np.sqrt((miss**2).mean())), tuple(plateaus))


def _upright(plateaus: list[Plateau], length: float) -> tuple[np.ndarray, np.ndarray]:
    """Response (3, 3) and zeros (3,) of axes taken for upright."""
    by = {d: np.mean([p.mean for p in plateaus if p.direction == d], axis=0) for d in DIRECTIONS}
    pairs = [(by[DIRECTIONS[2 * i]], by[DIRECTIONS[2 * i + 1]]) for i in range(3)]
    response = np.stack([(up - down) / (2 * length) for up, down in pairs], axis=1)
    zero = np.array([(up[i] + down[i]) / 2 for i, (up, down) in enumerate(pairs)])
    return response, zero


def _length_error(
    x: Float[np.ndarray, "6"], readings: Float[np.ndarray, "k 3"], length: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corrected less known length (k,), its slope (k, 6), and the directions (k, 3)."""
    true = (readings - x[:3]) / x[3:]
    size = np.linalg.norm(true, axis=1)
    towards = true / size[:, None]
    slope = np.concatenate([-towards / x[3:], -towards * true / x[3:]], axis=1)
    return size - length, slope, towards


def _spread(miss: np.ndarray, weight: np.ndarray) -> float:
    """How many times larger errors are than readings alone explain; 1 where six say nothing."""
    surplus = len(miss) - 6
    if surplus <= 0:
        return 1.0
    return max(1.0, float(np.sqrt((weight * miss**2).sum() / surplus)))
