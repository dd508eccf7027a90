"""Inertial streams: boards average over their sample interval; sensors err as a profile says."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mocap_jax.recording import InertialStream
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.rig import Rig, inertial_readings
from mocap_jax.simulation.spline import PoseSpline

_NODES = 4
_CHUNK = 2000

Parameters = dict[str, np.ndarray]


def sample_times(duration: float, rate_hz: float) -> Float[np.ndarray, "n"]:
    """Centres of all whole sample intervals within a recording [s]."""
    count = int(np.floor(duration * rate_hz + 1e-9))
    return (np.arange(count) + 0.5) / rate_hz


def sample_inertial(
    rig: Rig,
    spline: PoseSpline,
    boards: tuple[str, ...],
    time: Float[np.ndarray, "n"],
    profile: Profile,
    seed: int,
    orientations: Mapping[str, Float[np.ndarray, "n 4"]] | None = None,
) -> tuple[dict[str, InertialStream], Parameters]:
    """Readings of all boards.

    A sample is the mean over [t - h/2, t + h/2] by Gauss-Legendre quadrature with 4 points (exact
    for polynomials of degree 7). Scale error, bias and saturation act before the mean, as in the
    converter; white noise is stated per sample and added to it.

    Args:
        rig: the true body with its sensors.
        spline: motion of the rig's model.
        boards: names of the boards, in the rig's order.
        time: centres of the sample intervals, uniform [s].
        profile: what errs how much.
        seed: of the random streams.
        orientations: that boards report (wxyz), by name; default none.
    """
    errors = _errors(boards, time, profile, seed)
    mean = _means(rig, spline, time, errors, profile)
    streams = {}
    parameters: Parameters = {}
    missing = np.full((len(time), 4), np.nan)
    for i, board in enumerate(boards):
        force, rate = mean[:, i, :3], mean[:, i, 3:]
        if profile.white:
            noise = stream(seed, f"inertial_noise/{board}").standard_normal((len(time), 6))
            force = force + profile.stated.accelerometer * noise[:, :3]
            rate = rate + profile.stated.gyroscope * noise[:, 3:]
        offset = profile.clock_offset * float(
            np.clip(stream(seed, f"clock/{board}").standard_normal(), -1.5, 1.5)
        )
        kept = _kept(len(time), profile, stream(seed, f"loss/{board}"))
        turned = (orientations or {}).get(board, missing)
        streams[board] = InertialStream(time[kept] + offset, force[kept], rate[kept], turned[kept])
        parameters |= {
            f"accelerometer_bias/{board}": errors.bias[0, i, :3],
            f"gyroscope_bias/{board}": errors.bias[0, i, 3:],
            f"accelerometer_drift/{board}": errors.bias[:, i, :3] - errors.bias[0, i, :3],
            f"gyroscope_drift/{board}": errors.bias[:, i, 3:] - errors.bias[0, i, 3:],
            f"accelerometer_scale/{board}": errors.scale[i, :3],
            f"gyroscope_scale/{board}": errors.scale[i, 3:],
            f"clock_offset/{board}": np.array(offset),
        }
    return streams, parameters


class _Errors:
    """Deterministic errors: bias over time (n, boards, 6) and scale (boards, 6)."""

    def __init__(self, bias: np.ndarray, scale: np.ndarray) -> None:
        self.bias, self.scale = bias, scale


def _errors(boards: tuple[str, ...], time: np.ndarray, profile: Profile, seed: int) -> _Errors:
    step = float(time[1] - time[0])
    start = np.repeat([profile.accelerometer_bias, profile.gyroscope_bias], 3)
    walk = np.repeat([profile.accelerometer_drift, profile.gyroscope_drift], 3) * np.sqrt(step)
    bias = np.zeros((len(time), len(boards), 6))
    scale = np.zeros((len(boards), 6))
    for i, board in enumerate(boards):
        rng = stream(seed, f"inertial_errors/{board}")
        bias[0, i] = start * rng.standard_normal(6)
        scale[i] = 1.0 + profile.scale * rng.standard_normal(6)
        if walk.any():
            bias[1:, i] = walk * rng.standard_normal((len(time) - 1, 6))
    return _Errors(np.cumsum(bias, axis=0), scale)


def _means(
    rig: Rig, spline: PoseSpline, time: np.ndarray, errors: _Errors, profile: Profile
) -> Float[np.ndarray, "n boards 6"]:
    """Mean reading over each interval, in pieces so that memory stays bounded."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    half = 0.5 * float(time[1] - time[0])
    limit = np.repeat([profile.accelerometer_limit, profile.gyroscope_limit], 3)
    pieces = []
    for first in range(0, len(time), _CHUNK):
        rows = slice(first, first + _CHUNK)
        at = (time[rows, None] + half * nodes).ravel()
        exact = inertial_readings(rig, spline, np.clip(at, spline.start, spline.end))
        exact = exact.reshape(-1, _NODES, *exact.shape[1:])
        raw = np.clip(errors.scale * exact + errors.bias[rows, None], -limit, limit)
        pieces.append(np.einsum("k,nkbi->nbi", 0.5 * weights, raw))
    return np.concatenate(pieces)


def _kept(count: int, profile: Profile, rng: np.random.Generator) -> np.ndarray:
    """Mask of samples that were not lost; losses come in bursts of geometric length."""
    kept = np.ones(count, bool)
    if profile.loss:
        starts = np.flatnonzero(rng.random(count) < profile.loss / profile.loss_burst)
        for start, length in zip(
            starts, rng.geometric(1.0 / profile.loss_burst, len(starts)), strict=True
        ):
            # The first two samples fix the start and rate of a stream's clock: never lost.
            kept[max(start, 2) : start + length] = False
    return kept
