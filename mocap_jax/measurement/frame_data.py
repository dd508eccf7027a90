"""`FrameData`: a recording's streams brought to one uniform frame grid, as fixed-shape arrays.

Missing data are NaN (inertial, root) or weight zero (ranges), never a different shape.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float, Int

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.recording import (
    InertialStream,
    RangeStream,
    Recording,
    RootStream,
    frame_extent,
)

ArrayLike = jax.Array | np.ndarray

# Samples closer to a grid time than this are taken as they are [s].
_SAME_TIME = 1e-5
# A gap is a spacing of more than this many nominal intervals.
_GAP = 1.6
# A cubic spline takes this many samples.
_SPLINE = 4


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FrameData:
    """Measurements on a uniform grid of t frames, s sensors, at most k ranges a frame."""

    time: Float[ArrayLike, "t"]
    step: Float[ArrayLike, ""]
    """Grid step h [s]."""
    accelerometer: Float[ArrayLike, "t s 3"]
    gyroscope: Float[ArrayLike, "t s 3"]
    orientation: Float[ArrayLike, "t s 4"]
    range_distance: Float[ArrayLike, "t k"]
    range_weight: Float[ArrayLike, "t k"]
    """Confidence w_s w_t; 0 where there is no range."""
    range_source: Int[ArrayLike, "t k"]
    """Site index of the source."""
    range_receiver: Int[ArrayLike, "t k"]
    """Site index of the receiver."""
    range_lead: Float[ArrayLike, "t k"]
    """Emission at time[frame] - lead * step, lead in [0, 1)."""
    root_position: Float[ArrayLike, "t 3"]
    root_orientation: Float[ArrayLike, "t 4"]
    sensors: tuple[str, ...] = dataclasses.field(metadata={"static": True})
    """Names of the sensors, in the order of the arrays."""
    sites: tuple[int, ...] = dataclasses.field(metadata={"static": True})
    """Site index in the body of each sensor."""
    kinds: str = dataclasses.field(default="AGDO", metadata={"static": True})
    """Measurement kinds kept: A accelerometer, G gyroscope, D distance, O orientation. (M,
    magnetometer, may be named; its readings are not among these arrays.)"""


def gather(
    recording: Recording,
    body: Body,
    *,
    kinds: str = "AGDO",
    root: bool = True,
    rate_hz: float | None = None,
) -> FrameData:
    """Bring a recording to a uniform frame grid.

    Args:
        recording: the measured streams.
        body: its sites carry the sensors, sources and anchors.
        kinds: which measurements to keep, letters of "AGDOM".
        root: keep the externally measured root pose.
        rate_hz: grid rate; default the highest inertial rate (or 120 Hz without inertial data).

    Raises:
        InputError: unknown kind, no usable stream, a span that no grid fits (`frame_extent`), or a
            sensor without a site in the body.
    """
    unknown = set(kinds) - set("AGDOM")
    if unknown or not kinds:
        raise InputError(
            f"sensors '{kinds}': valid are letters of A, G, D, O, M (for example A,G,D)"
        )
    if not recording.inertial and recording.ranges is None:
        raise InputError("the recording has neither inertial nor range data")
    site_of = {s.name: s.site for s in recording.setup.sensors}
    names = tuple(recording.inertial)
    sites = tuple(site_of_sensor(body, name, site_of) for name in names)
    time = _grid(recording, rate_hz)
    step = float(time[1] - time[0])
    streams = [_resample_inertial(recording.inertial[n], time) for n in names]
    stack = lambda i, width: (  # noqa: E731
        np.stack([s[i] for s in streams], axis=1) if streams else np.zeros((len(time), 0, width))
    )
    accelerometer, gyroscope, orientation = stack(0, 3), stack(1, 3), stack(2, 4)
    ranges = recording.ranges if "D" in kinds else None
    root_position, root_orientation = _root(recording.root if root else None, time)
    return FrameData(
        time,
        np.asarray(step),
        accelerometer if "A" in kinds else np.full_like(accelerometer, np.nan),
        gyroscope if "G" in kinds else np.full_like(gyroscope, np.nan),
        orientation if "O" in kinds else np.full_like(orientation, np.nan),
        **_ranges(ranges, body, site_of, time, step, recording.setup.pulse_interval),
        root_position=root_position,
        root_orientation=root_orientation,
        sensors=names,
        sites=sites,
        kinds=kinds,
    )


def site_of_sensor(body: Body, name: str, site_of: dict[str, str]) -> int:
    """Index of the site that carries a sensor.

    Args:
        body: the body.
        name: of the sensor.
        site_of: names of sites by sensor; a sensor not named sits on the site of its own name.

    Raises:
        InputError: the body has no such site.
    """
    site = site_of.get(name, name)
    if site not in body.topology.site_names:
        raise unknown_name(f"site for sensor '{name}':", site, body.topology.site_names)
    return body.topology.site_names.index(site)


def _grid(recording: Recording, rate_hz: float | None) -> np.ndarray:
    extent = frame_extent(recording, rate_hz)
    return extent.start + np.arange(extent.frames) / extent.rate_hz


def _resample(stream_time: np.ndarray, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Cubic interpolation inside gap-free stretches; NaN elsewhere; exact where stamps agree."""
    out = np.full((len(time), values.shape[1]), np.nan)
    good = np.isfinite(values).all(axis=1)
    t, x = stream_time[good], values[good]
    if len(t) < 2:
        return out
    nominal = float(np.median(np.diff(t)))
    for stretch in np.split(np.arange(len(t)), np.flatnonzero(np.diff(t) > _GAP * nominal) + 1):
        ts, xs = t[stretch], x[stretch]
        tolerance = max(_SAME_TIME, 1e-3 * nominal)
        inside = np.flatnonzero((time >= ts[0] - tolerance) & (time <= ts[-1] + tolerance))
        after = np.searchsorted(ts, time[inside] - tolerance).clip(0, len(ts) - 1)
        same = np.abs(ts[after] - time[inside]) < tolerance
        out[inside[same]] = xs[after[same]]
        between = inside[~same]
        if len(ts) >= _SPLINE and len(between):
            out[between] = _spline(ts, xs, np.clip(time[between], ts[0], ts[-1]))
    return out


def _spline(stamps: np.ndarray, values: np.ndarray, time: np.ndarray) -> Float[np.ndarray, "n m"]:
    # Only streams whose stamps are off the grid need it, and it takes half a second to import.
    from scipy.interpolate import CubicSpline

    return CubicSpline(stamps, values)(time)


def _resample_inertial(
    stream: InertialStream, time: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = np.asarray(stream.time)
    quat = np.array(stream.orientation)
    if np.isfinite(quat).any():
        # Continuous sign, so that components may be interpolated; renormalised afterwards.
        flips = np.sign(np.nan_to_num((quat[1:] * quat[:-1]).sum(axis=1), nan=1.0))
        quat[1:] *= np.cumprod(np.where(flips < 0, -1.0, 1.0))[:, None]
    quat = _resample(t, quat, time)
    return (
        _resample(t, np.asarray(stream.accelerometer), time),
        _resample(t, np.asarray(stream.gyroscope), time),
        quat / np.linalg.norm(quat, axis=1, keepdims=True),
    )


def _root(stream: RootStream | None, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if stream is None:
        return np.full((len(time), 3), np.nan), np.full((len(time), 4), np.nan)
    as_inertial = InertialStream(
        stream.time, stream.position, np.zeros_like(stream.position), stream.orientation
    )
    position, _, orientation = _resample_inertial(as_inertial, time)
    return position, orientation


def _ranges(
    stream: RangeStream | None,
    body: Body,
    site_of: dict[str, str],
    time: np.ndarray,
    step: float,
    pulse_interval: float,
) -> dict[str, np.ndarray]:
    """Distances, weights, source and receiver sites, leads: each of shape (t, k)."""
    # One pulse after the other; more where sources of several frequencies sound side by side.
    receivers = len(stream.receiver_names) if stream is not None else 0
    nominal = int(np.ceil(step / pulse_interval - 1e-9)) * receivers
    if stream is None or not len(stream.time):
        return _named(*_no_ranges(len(time), nominal))
    source_site = np.array([site_of_sensor(body, n, site_of) for n in stream.source_names])
    receiver_site = np.array([site_of_sensor(body, n, site_of) for n in stream.receiver_names])
    position = (np.asarray(stream.time) - time[0]) / step
    frame = np.ceil(position - 1e-9).astype(int)
    usable = (frame >= 1) & (frame < len(time)) & (np.asarray(stream.confidence) > 0)
    usable &= np.isfinite(np.asarray(stream.distance))
    chosen = np.flatnonzero(usable)
    chosen = chosen[np.argsort(frame[chosen], kind="stable")]
    rows = frame[chosen]
    columns = np.arange(len(rows)) - np.searchsorted(rows, rows)
    width = max(nominal, int(np.bincount(rows, minlength=1).max()))
    distance, weight, source, receiver, lead = _no_ranges(len(time), width)
    at = (rows, columns)
    distance[at] = np.asarray(stream.distance)[chosen]
    weight[at] = np.asarray(stream.confidence)[chosen]
    source[at] = source_site[np.asarray(stream.source)[chosen]]
    receiver[at] = receiver_site[np.asarray(stream.receiver)[chosen]]
    lead[at] = rows - position[chosen]
    return _named(distance, weight, source, receiver, lead)


def _no_ranges(
    frames: int, width: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Distances, weights, source and receiver sites, leads to be filled in."""
    shape = (frames, width)
    return (
        np.ones(shape), np.zeros(shape), np.zeros(shape, int), np.zeros(shape, int),
        np.zeros(shape),
    )  # fmt: skip


def _named(
    distance: np.ndarray, weight: np.ndarray, source: np.ndarray, receiver: np.ndarray,
    lead: np.ndarray,
) -> dict[str, np.ndarray]:  # fmt: skip
    return {
        "range_distance": distance,
        "range_weight": weight,
        "range_source": source,
        "range_receiver": receiver,
        "range_lead": lead,
    }
