"""Magnetometers as a residual: the heading that each tells, robust since fields are disturbed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body, site_frames
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.measurement.frame_data import site_of_sensor
from mocap_jax.recording import MagneticStream, Recording
from mocap_jax.residuals.magnetic import magnetic_heading_error
from mocap_jax.residuals.robust import LossName, root_of_weight

# Samples farther than this many intervals from a frame do not count for it.
_GAP = 1.6


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
        InputError: no magnetic stream, an unknown sensor, or figures not above zero.
    """
    if not recording.magnetic:
        raise InputError("magnetic heading: the recording has no magnetic streams (/magnetic/...)")
    if not (sigma > 0 and correlation_time > 0):
        raise InputError("magnetic heading: sigma and correlation_time must be above 0")
    names = tuple(recording.magnetic) if sensors is None else sensors
    for name in names:
        if name not in recording.magnetic:
            raise unknown_name("magnetic sensor", name, recording.magnetic)
    site_of = {s.name: s.site for s in recording.setup.sensors}
    sites = tuple(site_of_sensor(body, name, site_of) for name in names)
    time = np.asarray(time)
    share = min(1.0, float(time[1] - time[0]) / correlation_time)
    field = np.stack([field_at(recording.magnetic[n], time) for n in names], axis=1)
    there = np.isfinite(field).all(-1)
    rows = {"field": np.nan_to_num(field), "root_information": np.sqrt(share) * there}
    # A frame counts for a part: the loss sees the error as it is.
    function = _Heading(sites, float(north), float(sigma), loss, scale * float(np.sqrt(share)))
    return UserResidual("magnetometer", function, 1), rows


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
