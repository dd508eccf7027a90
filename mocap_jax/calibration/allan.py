"""Overlapping Allan deviation, and the noise processes read off it.

    sigma^2(tau) = sum_k (theta_(k+2m) - 2 theta_(k+m) + theta_k)^2 / (2 tau^2 (N - 2m))

with theta the running integral of the readings at N times and tau = m steps (IEEE Std 952-1997,
annex C; Riley, NIST Special Publication 1065, section 5.2.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import nnls

_FLOOR = 2.0 * np.log(2.0) / np.pi
"""Allan variance of flicker noise of bias instability 1."""
_SIGNIFICANT = 2.0
"""A process counts as seen from this many standard deviations of its variance on."""
_OVERLAP = np.array([1.5, 2.2, 2.2, 2.2])
"""Neighbouring octaves share what they see, slow processes most: the fit's deviations are larger by
this than if they were independent. Found from 60 simulated recordings each of 200 to 1000 s with
white noise and random walks of four sizes (1.2 to 1.7 and 1.9 to 2.6)."""
_LONGEST = 5
"""Averages of the longest time in the recording: one in this many."""


@dataclass(frozen=True)
class AllanCurve:
    """Overlapping Allan deviation of c channels."""

    tau: Float[np.ndarray, "m"]
    """Averaging time [s]."""
    deviation: Float[np.ndarray, "m c"]
    """In the readings' unit."""
    freedom: Float[np.ndarray, "m"]
    """Equivalent degrees of freedom for white noise (Riley, table 5)."""

    @property
    def relative_sigma(self) -> Float[np.ndarray, "m"]:
        """Relative standard deviation of the deviation itself."""
        return 1.0 / np.sqrt(2.0 * self.freedom)


@dataclass(frozen=True)
class AllanFit:
    """Noise processes of c channels; 0 where none is seen, NaN sigma where it is not known."""

    white: Float[np.ndarray, "c"]
    """N: sigma(tau) = N / sqrt(tau)."""
    instability: Float[np.ndarray, "c"]
    """B: sigma = 0.664 B."""
    random_walk: Float[np.ndarray, "c"]
    """K: sigma(tau) = K sqrt(tau / 3)."""
    quantisation: Float[np.ndarray, "c"]
    """Q: sigma(tau) = sqrt(3) Q / tau."""
    sigma: Float[np.ndarray, "4 c"]
    """Their standard deviations, in the same order."""

    def deviation(self, tau: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m c"]:
        """The curve these processes make."""
        parts = (self.white, self.instability, self.random_walk, self.quantisation)
        return np.sqrt(_shapes(tau) @ np.square(np.array(parts)))


def averaging_lengths(count: int, per_decade: int | None = None) -> Int[np.ndarray, "m"]:
    """Numbers of samples to average: powers of two, or about as many per decade."""
    most = max(count // _LONGEST, 1)
    if per_decade is None:
        lengths = 2 ** np.arange(int(np.log2(most)) + 1)
    else:
        number = max(int(np.ceil(per_decade * np.log10(most))), 1) + 1
        lengths = np.unique(np.rint(np.geomspace(1, most, number)).astype(int))
    return lengths


def allan_deviation(
    values: Float[np.ndarray, "n c"], step: float, lengths: Int[np.ndarray, "m"] | None = None
) -> AllanCurve:
    """Overlapping Allan deviation.

    Args:
        values: readings at equal distances in time (means over their interval, as rates are).
        step: that distance [s].
        lengths: samples to average, up to a third of all; default `averaging_lengths`.
    """
    count = len(values)
    lengths = averaging_lengths(count) if lengths is None else lengths
    # Without its mean, the integral keeps its digits.
    phase = np.zeros((count + 1, values.shape[1]))
    np.cumsum(values - values.mean(axis=0), axis=0, out=phase[1:])
    deviation = np.empty((len(lengths), values.shape[1]))
    for i, m in enumerate(lengths):
        second = phase[2 * m :] - 2.0 * phase[m:-m] + phase[: -2 * m]
        deviation[i] = np.sqrt((second**2).mean(axis=0) / 2.0) / m
    return AllanCurve(lengths * step, deviation, _freedom(count + 1, lengths))


def _freedom(points: int, m: Int[np.ndarray, "m"]) -> Float[np.ndarray, "m"]:
    """Riley 2008, table 5, white frequency noise, overlapping."""
    n = float(points)
    return (1.5 * (n - 1) / m - 2.0 * (n - 2) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0)


def fit_processes(curve: AllanCurve) -> AllanFit:
    """Noise processes of a curve at octaves, by weighted non-negative least squares on variances.

    Values at octaves are nearly independent, each with variance 2 sigma^4 / freedom; sigma is taken
    from the fit before. Processes that are not significant are left out and the rest fitted again.
    """
    fits = [_fit(curve, column) for column in curve.deviation.T]
    value, sigma = (np.array(x).T for x in zip(*fits, strict=True))
    white, floor, walk, quantisation = value
    return AllanFit(white, floor, walk, quantisation, sigma)


def _shapes(tau: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m 4"]:
    """Allan variances of the four processes of size 1."""
    return np.stack([1.0 / tau, np.full_like(tau, _FLOOR), tau / 3.0, 3.0 / tau**2], axis=1)


def _fit(curve: AllanCurve, deviation: Float[np.ndarray, "m"]) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of the four processes and their standard deviations."""
    shapes, variance = _shapes(curve.tau), deviation**2
    used = np.ones(4, bool)
    while True:
        size, sigma = _weighted(shapes, variance, curve.freedom, used)
        weak = used & (size < _SIGNIFICANT * sigma)
        weak[0] = False  # there is always some white noise
        if not weak.any():
            break
        used[np.flatnonzero(weak)[np.argmin((size / sigma)[weak])]] = False
    value = np.sqrt(size)
    with np.errstate(divide="ignore", invalid="ignore"):
        return value, np.where(value > 0, sigma / (2.0 * value), np.nan)


def _weighted(
    shapes: np.ndarray, variance: np.ndarray, freedom: np.ndarray, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Squares of the sizes and their standard deviations, 0 and infinite where not used."""
    size, sigma = np.zeros(4), np.full(4, np.inf)
    model = variance
    for _ in range(6):
        weight = np.sqrt(freedom / 2.0) / np.maximum(model, 1e-300)
        rows = shapes[:, used] * weight[:, None]
        scale = np.linalg.norm(rows, axis=0)
        found, _ = nnls(rows / scale, variance * weight)
        size[used] = found / scale
        model = shapes @ size
    inverse = np.linalg.pinv((rows / scale).T @ (rows / scale))
    sigma[used] = _OVERLAP[used] * np.sqrt(np.diag(inverse)) / scale
    return size, sigma
