"""Kind `M`, magnetometers, in optimiser and filter: which way north is, and how far to trust it."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, site_frames
from mocap_jax.errors import InputError
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.inputs import measured_kinds
from mocap_jax.estimate.magnetic_heading import MagneticReadings, field_at, magnetic_readings
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.initialise import RestEstimate, rest_pose
from mocap_jax.recording import Recording

# Without a rest hold, north is where the first so many seconds have it.
_FIRST = 1.0


def sequence_readings(
    recording: Recording,
    body: Body,
    options: OptimiseOptions,
    time: Float[np.ndarray, "t"],
    *,
    root_given: bool,
) -> MagneticReadings | None:
    """What the whole-sequence problem reads of magnetometers; None without kind `M`.

    Raises:
        InputError: kind `M` without magnetic streams, or north neither stated nor seen.
    """
    if "M" not in options.kinds:
        return None
    _check(recording)
    north = options.magnetic_north
    if north is None:
        north = north_at_rest(recording, body, rest_pose(recording, body, use_root=root_given))
    return magnetic_readings(recording, body, time, north=north, sensors=_worn(recording))


def frame_fields(
    recording: Recording, sensors: tuple[str, ...], time: Float[np.ndarray, "t"], kinds: str
) -> Float[np.ndarray, "t s 3"]:
    """Readings of each sensor's magnetometer at the frames; NaN where there are none [T].

    Raises:
        InputError: kind `M` without magnetic streams.
    """
    out = np.full((len(time), len(sensors), 3), np.nan)
    if "M" not in kinds:
        return out
    _check(recording)
    for i, name in enumerate(sensors):
        if name in recording.magnetic:
            out[:, i] = field_at(recording.magnetic[name], time)
    return out


def filter_figures(
    recording: Recording, body: Body, options: EkfOptions, rest: RestEstimate, step: float
) -> Float[np.ndarray, "4"]:
    """What `Parameters.magnetic` of the filter holds."""
    north = options.magnetic_north
    if north is None and "M" in options.kinds:
        north = north_at_rest(recording, body, rest)
    shared = max(1.0, options.magnetic_time / step)
    pull = max(1.0, options.magnetic_pull / step)
    return np.array([north or 0.0, options.magnetic_sigma, shared, pull])


def stray_remarks(recording: Recording, kinds: str) -> tuple[str, ...]:
    """Which magnetometers are left out under kind `M`, because no board bears their name."""
    strays = _strays(recording) if "M" in kinds else ()
    if not strays:
        return ()
    return (
        f"Magnetometers left out, of which there are no inertial readings: {', '.join(strays)} "
        f"(sensors: {', '.join(recording.inertial)}).",
    )


def north_at_rest(recording: Recording, body: Body, rest: RestEstimate) -> float:
    """Direction of magnetic north in the world [rad], from X about Z, in the pose at rest.

    The median over the sensors, since fields are disturbed near some of them.
    """
    sites = dict(zip(rest.sensors, rest.sites, strict=True))
    rotation = np.asarray(jax.jit(site_frames)(rest.mounted(body), rest.q).rotation)
    end = rest.still.end if rest.still.end > rest.still.start else rest.still.start + _FIRST
    angles = []
    for name in _worn(recording):
        time, field = (np.asarray(x) for x in dataclasses.astuple(recording.magnetic[name]))
        held = (time >= rest.still.start) & (time <= end) & np.isfinite(field).all(1)
        if held.any():
            x, y, _ = rotation[sites[name]] @ field[held].mean(0)
            angles.append(np.arctan2(y, x))
    if not angles:
        raise InputError(
            "kind M: no magnetometer reads anything at the start, so that north is not known; "
            "state it (magnetic_north)"
        )
    middle = np.arctan2(np.sin(angles).mean(), np.cos(angles).mean())
    off = np.angle(np.exp(1j * (np.array(angles) - middle)))
    return float(middle + np.median(off))


def _worn(recording: Recording) -> tuple[str, ...]:
    """Magnetometers of boards that are there."""
    return tuple(name for name in recording.magnetic if name in recording.inertial)


def _strays(recording: Recording) -> tuple[str, ...]:
    return tuple(name for name in recording.magnetic if name not in recording.inertial)


def _check(recording: Recording) -> None:
    if _worn(recording):
        return
    strays = ", ".join(_strays(recording))
    of = f" (only of {strays}, which have no /inertial/<sensor>)" if strays else ""
    raise InputError(
        f"kind M: the recording has no magnetic streams (/magnetic/<sensor>) of its sensors{of}; "
        f"valid kinds: {', '.join(measured_kinds(recording)) or '(none)'}"
    )
