"""Magnetometers as a residual: the heading that each tells, robust since fields are disturbed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body, site_frames
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.sequence.user_residuals import UserResidual, frame_step
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.measurement.frame_data import site_of_sensor
from mocap_jax.recording import MagneticStream, Recording
from mocap_jax.residuals.magnetic import magnetic_heading_error
from mocap_jax.residuals.robust import LossName, root_of_weight

# Samples farther than this many intervals from a frame do not count for it.
_GAP = 1.6


class MagneticReadings(NamedTuple):
    """What magnetometers tell a whole-sequence problem."""

    sites: tuple[int, ...]
    """That carry them."""
    field: Float[np.ndarray, "t s 3"]
    """In the sensors' frames at the frames; NaN where there is none [T]."""
    north: float
    """Direction of magnetic north in the world, from X about Z [rad]."""


@dataclass(frozen=True)
class _Heading:
    """`UserResidual.function`: whitened and robust heading errors of sensors."""

    sites: tuple[int, ...]
    north: float
    sigma: float
    loss: LossName
    scale: float

    def __call__(
        self, body: Body, q: Float[Array, "1 nq"], data: dict[str, Array]
    ) -> Float[Array, "s"]:
        R_world_sensor = site_frames(body, q[0]).rotation[np.array(self.sites)]
        error = magnetic_heading_error(R_world_sensor, data["field"], self.north)
        off = (data["root_information"] * error / self.sigma)[:, None]
        return (off * root_of_weight(off, self.loss, self.scale))[:, 0]


def magnetic_heading(
    recording: Recording,
    body: Body,
    time: Float[np.ndarray, "t"],
    *,
    north: float = 0.0,
    sensors: tuple[str, ...] | None = None,
    sigma: float = 0.2,
    correlation_time: float = 5.0,
    loss: LossName = "cauchy",
    scale: float = 3.0,
) -> tuple[UserResidual, dict[str, np.ndarray]]:
    """A residual for `OptimiseOptions.user_residuals`, and its data for `optimise`.

    Args:
        recording: with magnetic streams (`Recording.magnetic`).
        body: whose sites carry the sensors.
        time: of the frames, `gather(recording, body).time` [s].
        north: direction of magnetic north in the world, from X about Z [rad].
        sensors: names of those used; default all with a magnetic stream.
        sigma: standard deviation of a heading [rad] (de Vries et al. 2009: tenths of a radian
            indoors).
        correlation_time: how long such an error lasts [s]; frames within it count as one.
        loss: robust loss.
        scale: its threshold, in standard deviations.

    Returns:
        The residual "magnetometer" and its rows.

    Raises:
        InputError: no magnetic stream, an unknown sensor, figures not above zero, or fewer than
            two frames.
    """
    if not recording.magnetic:
        raise InputError("magnetic heading: the recording has no magnetic streams (/magnetic/...)")
    step = frame_step(time, "magnetic heading")
    readings = magnetic_readings(recording, body, time, north=north, sensors=sensors)
    return heading_residual(
        readings, step, sigma=sigma, correlation_time=correlation_time, loss=loss, scale=scale
    )


def magnetic_readings(
    recording: Recording, body: Body, time: Float[np.ndarray, "t"], *, north: float,
    sensors: tuple[str, ...] | None = None,
) -> MagneticReadings:  # fmt: skip
    """Magnetometers on the frame grid; arguments as those of `magnetic_heading`.

    Raises:
        InputError: an unknown sensor.
    """
    names = tuple(recording.magnetic) if sensors is None else sensors
    for name in names:
        if name not in recording.magnetic:
            raise unknown_name("magnetic sensor", name, recording.magnetic)
    site_of = {s.name: s.site for s in recording.setup.sensors}
    sites = tuple(site_of_sensor(body, name, site_of) for name in names)
    at = np.asarray(time)
    field = np.stack([field_at(recording.magnetic[n], at) for n in names], axis=1)
    return MagneticReadings(sites, field, float(north))


def heading_residual(
    readings: MagneticReadings, step: float, *, sigma: float, correlation_time: float,
    loss: LossName = "cauchy", scale: float = 3.0,
) -> tuple[UserResidual, dict[str, np.ndarray]]:  # fmt: skip
    """The residual "magnetometer" and its rows.

    Args:
        readings: on the frame grid.
        step: between frames [s].
        sigma: see `magnetic_heading`, as the others.
        correlation_time: [s].
        loss: robust loss.
        scale: its threshold.

    Raises:
        InputError: figures not above zero.
    """
    if not (sigma > 0 and correlation_time > 0):
        raise InputError("magnetic heading: sigma and correlation_time must be above 0")
    share = min(1.0, step / correlation_time)
    there = np.isfinite(readings.field).all(-1)
    rows = {"field": np.nan_to_num(readings.field), "root_information": np.sqrt(share) * there}
    # A frame counts for a part: the loss sees the error as it is.
    scaled = scale * float(np.sqrt(share))
    function = _Heading(readings.sites, readings.north, float(sigma), loss, scaled)
    return UserResidual("magnetometer", function, 1), rows


def sequence_headings(
    readings: MagneticReadings | None, step: float, options: OptimiseOptions
) -> tuple[tuple[UserResidual, ...], tuple[dict[str, np.ndarray], ...]]:
    """The residual of kind `M` in a whole-sequence problem and its rows; empty without readings."""
    if readings is None:
        return (), ()
    residual, rows = heading_residual(
        readings, step, sigma=options.magnetic_sigma, correlation_time=options.magnetic_time
    )
    return (residual,), (rows,)


def field_at(stream: MagneticStream, time: np.ndarray) -> Float[np.ndarray, "t 3"]:
    """Readings at the frames, between samples along straight lines; NaN in gaps [T]."""
    stamps, field = np.asarray(stream.time), np.asarray(stream.field)
    good = np.isfinite(field).all(1)
    out = np.full((len(time), 3), np.nan)
    if good.sum() < 2:
        return out
    stamps, field = stamps[good], field[good]
    interval = float(np.median(np.diff(stamps)))
    after = np.searchsorted(stamps, time).clip(1, len(stamps) - 1)
    near = np.abs(stamps[after] - stamps[after - 1]) < _GAP * interval
    inside = near & (time > stamps[0] - interval / 2) & (time < stamps[-1] + interval / 2)
    for axis in range(3):
        out[inside, axis] = np.interp(time[inside], stamps, field[:, axis])
    return out
