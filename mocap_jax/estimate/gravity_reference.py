"""Gravity reference: boards that do not accelerate feel gravity alone, and tell which way is down.

Where a board feels about g and hardly turns for a while, it stands still or moves evenly. Its
accelerometer then measures tilt without drift, whether or not accelerations are used otherwise:
integrated rates drift, and an acceleration of a free root may stand in for a tilt.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_opening

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.gravity_options import GravityOptions
from mocap_jax.initialise import RestEstimate
from mocap_jax.measurement import FrameData, gather
from mocap_jax.recording import Recording


class GravityReference(NamedTuple):
    """What a whole-sequence problem takes of boards that do not accelerate."""

    force: Float[np.ndarray, "t s 3"]
    """What boards feel [m/s^2]; zero where that is not known."""
    information: Float[np.ndarray, "t s"]
    """Of its direction [1/rad^2]: zero where a board may accelerate."""
    scale: float
    """Whitened norm beyond which a tilt is an outlier."""
    remark: str
    """How often the boards tell."""


def gravity_reference(data: FrameData, body: Body, options: GravityOptions) -> GravityReference:
    """The gravity reference of a whole sequence.

    Args:
        data: with accelerometers and gyroscopes, used otherwise or not.
        body: carries them.
        options: thresholds and figures.

    Raises:
        InputError: the recording has no board with accelerometer and gyroscope.
    """
    still = still_boards(data, _size(body), options)
    share = min(1.0, float(data.step) / options.correlation_time)
    return GravityReference(
        np.nan_to_num(np.asarray(data.accelerometer)),
        still * share / options.sigma**2,
        # A frame counts for a part: the loss sees the error as it is.
        float(options.scale * np.sqrt(share)),
        _remark(data.sensors, still),
    )


def frame_gravity(
    recording: Recording, body: Body, options: EkfOptions, rest: RestEstimate
) -> Float[np.ndarray, "t s 3"] | tuple[()]:
    """What `FrameInput.gravity` of the filter holds: NaN where a board may accelerate [m/s^2].

    Raises:
        InputError: as `gravity_reference`.
    """
    if options.gravity is None:
        return ()
    data = gather(recording, body, kinds="AG", root=False, rate_hz=options.rate_hz)
    still = still_boards(data, _size(body), options.gravity)
    return np.where(still[..., None], data.accelerometer - rest.accelerometer_bias, np.nan)


def gravity_figures(
    options: GravityOptions | None, step: float
) -> Float[np.ndarray, "4"] | tuple[()]:
    """What `Parameters.gravity` of the filter holds."""
    if options is None:
        return ()
    shared, pull = (max(1.0, x / step) for x in (options.correlation_time, options.pull))
    return np.array([options.sigma, shared, pull, options.scale])


def still_boards(
    data: FrameData, gravity: float, options: GravityOptions
) -> Bool[np.ndarray, "t s"]:
    """Frames in which each board does not accelerate; never where a reading is missing.

    Args:
        data: with accelerometers and gyroscopes.
        gravity: its size [m/s^2].
        options: thresholds.

    Raises:
        InputError: no board has both.
    """
    force, rate = np.asarray(data.accelerometer), np.asarray(data.gyroscope)
    known = np.isfinite(force).all(-1) & np.isfinite(rate).all(-1)
    if not known.any():
        raise InputError(
            "gravity reference: no board of the recording has both accelerometer and gyroscope"
        )
    with np.errstate(invalid="ignore"):
        quiet = np.abs(np.linalg.norm(force, axis=-1) - gravity) < options.acceleration
        quiet &= np.linalg.norm(rate, axis=-1) < options.turn
    frames = max(1, round(options.duration / float(data.step)))
    return _lasting(quiet & known, frames)


def _size(body: Body) -> float:
    """Of gravity [m/s^2]."""
    return float(np.linalg.norm(np.asarray(body.gravity)))


def _lasting(quiet: Bool[np.ndarray, "t s"], frames: int) -> Bool[np.ndarray, "t s"]:
    """Only stretches of at least so many frames."""
    return binary_opening(quiet, np.ones((frames, 1), bool))


def _remark(sensors: tuple[str, ...], still: Bool[np.ndarray, "t s"]) -> str:
    share = 100 * still.mean(0)
    each = ", ".join(f"{name} {x:.0f} %" for name, x in zip(sensors, share, strict=True))
    return f"Gravity reference: boards do not accelerate in these shares of the frames: {each}."
