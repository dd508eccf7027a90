"""What each board sends: readings, levels, bits, voltage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from scipy.interpolate import make_interp_spline

from mocap_jax.recording import InertialStream
from mocap_jax.signals.telemetry.converter import (
    READINGS,
    ConverterScales,
    accumulate,
    quantise,
)
from mocap_jax.signals.telemetry.encode import encode
from mocap_jax.signals.telemetry.frame import FRAME_BITS, FRAME_RATE_HZ
from mocap_jax.signals.telemetry.line import voltage
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.raw.transducer import SAMPLE_RATE_HZ


@dataclass(frozen=True)
class Board:
    """One board's telemetry."""

    bits: UInt8[np.ndarray, "k"]
    start: float
    """Beginning of its first frame's readings [s]; the first bit follows two frames later, since
    blocks hold two frames."""
    period: float
    """Length of its frames [s]."""
    levels: Int[np.ndarray, "n 6"]
    """12-bit levels of its frames."""
    exact: Float[np.ndarray, "n 6"]
    """Rates [rad/s] and specific forces [m/s^2] that they stand for."""

    def volts(self, first: int, count: int) -> Float[np.ndarray, "count"]:
        """Voltage (-1 to 1) from sample `first` of the driver box on."""
        time = (first + np.arange(count)) / SAMPLE_RATE_HZ - self.start - 2 * self.period
        return voltage(self.bits, time * (FRAME_BITS / self.period) - 0.5)


def make_board(
    name: str,
    stream_of_means: InertialStream,
    duration: float,
    profile: Profile,
    scales: ConverterScales,
    clock_ppm: float,
    seed: int,
) -> Board:
    """A board whose clock runs a little fast or slow.

    Args:
        name: of the board.
        stream_of_means: noise-free means at the nominal frame rate, from its start on.
        duration: of the recording [s].
        profile: its white noise is that of the frames; each of the 16 readings has four times it.
        scales: of the converter.
        clock_ppm: standard deviation of the clock's error.
        seed: of the random streams.
    """
    rng = stream(seed, f"raw_board/{name}")
    period = 1.0 / (FRAME_RATE_HZ * (1.0 + 1e-6 * clock_ppm * float(rng.standard_normal())))
    start = float(rng.uniform(0.0, period))
    count = int((duration - start) / period)
    grid = np.asarray(stream_of_means.time)
    values = np.concatenate(
        [np.asarray(stream_of_means.gyroscope), np.asarray(stream_of_means.accelerometer)], axis=1
    )
    centre = start + (np.arange(count) + 0.5) * period
    exact = make_interp_spline(grid, values, k=5)(np.clip(centre, grid[0], grid[-1]))
    sigma = np.repeat([profile.stated.gyroscope, profile.stated.accelerometer], 3)
    levels = np.empty((count, 6), np.int64)
    for first in range(0, count, 4096):
        rows = slice(first, first + 4096)
        noise = rng.standard_normal((len(exact[rows]), READINGS, 6)) * np.sqrt(READINGS) * sigma
        readings = exact[rows, None] + (noise if profile.white else _dither(noise.shape, scales))
        levels[rows] = accumulate(quantise(readings, scales))
    return Board(encode(levels)[0], start, period, levels, exact)


def _dither(shape: tuple[int, ...], scales: ConverterScales) -> Float[np.ndarray, "n 16 6"]:
    """Offsets spread evenly over a reading's step, which make the sum of 16 the finest."""
    spread = (np.arange(READINGS) + 0.5) / READINGS - 0.5
    return np.broadcast_to(spread[:, None] * 4 * scales.per_level, shape)
