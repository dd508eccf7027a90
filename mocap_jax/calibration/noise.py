"""Noise of inertial sensors from a still recording, by Allan deviation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from mocap_jax.calibration.allan import (
    AllanCurve,
    AllanFit,
    allan_deviation,
    averaging_lengths,
    fit_processes,
)
from mocap_jax.calibration.steady import SteadyOptions, steady_intervals
from mocap_jax.errors import InputError
from mocap_jax.recording import AxisNoise, Calibration, InertialStream, Recording
from mocap_jax.recording.calibration import triple

SENSOR_KINDS = ("accelerometer", "gyroscope")
# Readings are judged still in blocks of this length; the first and last of them are not used [s].
_BLOCK, _FEWEST = 1.0, 2.0


@dataclass(frozen=True)
class NoiseCalibrationOptions:
    """What is taken for still, and how finely curves are drawn."""

    shortest_s: float = 60.0
    """A shorter still interval says too little [s]."""
    still_force: float = 0.1
    """Largest standard deviation of specific force in a still block of 1 s [m/s^2]."""
    still_rate: float = 0.02
    """The same of angular rate [rad/s]."""
    most_missing: float = 0.05
    """Share of samples that may be missing; they are interpolated."""
    per_decade: int = 10
    """Averaging times of the curves."""


@dataclass(frozen=True)
class SensorNoise:
    """Noise of one sensor of three axes."""

    curve: AllanCurve
    fit: AllanFit
    per_sample: Float[np.ndarray, "3"]
    """Allan deviation of single samples: white noise with round-off, without drift."""
    rate_hz: float
    duration: float
    """Of the still interval [s]."""
    missing: float
    """Share of its samples that were lost."""


@dataclass(frozen=True)
class NoiseCalibration:
    """Noise of all sensors."""

    sensors: dict[str, dict[str, SensorNoise]]
    """By kind ("accelerometer", "gyroscope") and name."""
    skipped: dict[str, str] = field(default_factory=dict)
    """Sensors that could not be used, or `<sensor>/<kind>` where only that one of its kinds could
    not, and why."""

    @property
    def calibration(self) -> Calibration:
        """For a set-up."""
        figures = {
            kind: {name: _figures(noise.fit) for name, noise in found.items()}
            for kind, found in self.sensors.items()
        }
        return Calibration(
            accelerometer_noise=figures["accelerometer"], gyroscope_noise=figures["gyroscope"]
        )

    @property
    def per_sample(self) -> dict[str, float]:
        """RMS over sensors and axes of the noise of a sample, by names of `NoiseFigures`."""
        return {
            kind: float(np.sqrt(np.mean([noise.per_sample**2 for noise in found.values()])))
            for kind, found in self.sensors.items()
            if found
        }


def calibrate_noise(
    recording: Recording, options: NoiseCalibrationOptions | None = None
) -> NoiseCalibration:
    """White noise, bias instability and random walk of every sensor axis.

    The longest still interval of each board is used. The four processes of IEEE Std 952 (with the
    round-off of samples) are fitted to the Allan variances at octaves, each weighted by its degrees
    of freedom; what is not significant is 0.

    Args:
        recording: boards that lie still, the longer the better: an hour shows processes up to 12
            minutes.
        options: see there.

    Raises:
        InputError: no board lies still for long enough, or of none a reading can be used: too many
            samples are missing, or an axis reads the same all the time.
    """
    opts = options or NoiseCalibrationOptions()
    sensors: dict[str, dict[str, SensorNoise]] = {kind: {} for kind in SENSOR_KINDS}
    skipped: dict[str, str] = {}
    for name, stream in recording.inertial.items():
        try:
            rows = _still(stream, opts)
        except InputError as error:
            skipped[name] = str(error)
            continue
        for kind in SENSOR_KINDS:
            if not np.isfinite(np.asarray(getattr(stream, kind))).any():
                continue
            try:
                sensors[kind][name] = _sensor_noise(stream, kind, rows, opts)
            except InputError as error:
                skipped[f"{name}/{kind}"] = str(error)
    if not any(sensors.values()):
        if not skipped:
            raise InputError("no inertial sensors in the recording (topics /inertial/<sensor>)")
        name, reason = next(iter(skipped.items()))
        more = f" (and {len(skipped) - 1} more)" if len(skipped) > 1 else ""
        raise InputError(f"sensor '{name}'{more}: {reason}")
    return NoiseCalibration(sensors, skipped)


def _still(stream: InertialStream, opts: NoiseCalibrationOptions) -> slice:
    """Samples of the longest still interval."""
    channels = [np.asarray(stream.accelerometer), np.asarray(stream.gyroscope)]
    kept = [bool(np.isfinite(c).any()) for c in channels]
    if not any(kept):
        raise InputError("no readings")
    allowed = np.repeat([opts.still_force, opts.still_rate], 3)[np.repeat(kept, 3)]
    values = np.concatenate([c for c, there in zip(channels, kept, strict=True) if there], axis=1)
    time = np.asarray(stream.time)
    found = steady_intervals(time, values, allowed, SteadyOptions(_BLOCK, _FEWEST))
    longest = max(found, key=lambda s: time[s.stop - 1] - time[s.start], default=None)
    seconds = 0.0 if longest is None else float(time[longest.stop - 1] - time[longest.start])
    if longest is None or seconds < opts.shortest_s:
        lasts = f"less than {_FEWEST:g} s" if longest is None else f"{seconds:.1f} s"
        raise InputError(
            f"the longest still interval lasts {lasts} of {time[-1] - time[0]:.1f} s, not counting "
            f"its first and last {_BLOCK:g} s, which are left out; "
            f"at least {max(opts.shortest_s, _FEWEST):g} s are needed"
        )
    return longest


def _sensor_noise(
    stream: InertialStream, kind: str, rows: slice, opts: NoiseCalibrationOptions
) -> SensorNoise:
    time = np.asarray(stream.time)[rows]
    values, step, missing = _uniform(time, np.asarray(getattr(stream, kind))[rows])
    if missing > opts.most_missing:
        raise InputError(
            f"{100 * missing:.1f} % of the {kind}'s samples are missing; "
            f"at most {100 * opts.most_missing:g} % may"
        )
    constant = [axis for axis, x in zip("xyz", values.T, strict=True) if not np.ptp(x) > 0]
    if constant:
        raise InputError(
            f"the {kind} reads the same all the time on {', '.join(constant)}: it is stuck, or its "
            "steps are coarser than its noise, which is not 0"
        )
    curve = allan_deviation(values, step, averaging_lengths(len(values), opts.per_decade))
    fit = fit_processes(allan_deviation(values, step))
    return SensorNoise(
        curve, fit, curve.deviation[0], 1.0 / step, float(time[-1] - time[0]), missing
    )


def _uniform(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n 3"]
) -> tuple[np.ndarray, float, float]:
    """Readings at equal distances, missing ones interpolated; the distance; the share missing."""
    known = np.isfinite(values).all(axis=1)
    rough = float(np.median(np.diff(time)))
    place = np.concatenate([[0], np.cumsum(np.maximum(np.rint(np.diff(time) / rough), 1))])
    step = float((time[-1] - time[0]) / max(place[-1], 1))
    grid = np.arange(int(place[-1]) + 1)
    filled = np.stack([np.interp(grid, place[known], column[known]) for column in values.T], axis=1)
    return filled, step, 1.0 - float(known.sum()) / len(grid)


def _figures(fit: AllanFit) -> AxisNoise:
    return AxisNoise(*(triple(x) for x in (fit.white, fit.instability, fit.random_walk)))
