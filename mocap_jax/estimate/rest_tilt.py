"""Accelerometers in the rest hold tell tilt, whatever measurements the motion is estimated from."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.body import Body
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.measurement import FrameData, gather
from mocap_jax.recording import Recording


def gather_with_rest(
    recording: Recording, body: Body, options: OptimiseOptions, *, root: bool
) -> FrameData:
    """Measurements of the kinds chosen, and accelerations of a declared rest hold.

    Rates alone leave the first pose to the declared one. As for the filter, whose rest pose and
    mounting always come from gravity in the hold (Vlasic 2007, section 5.4), the accelerometers
    count there even where they are not among the kinds chosen.
    """
    chosen, rest = options.kinds, recording.setup.rest
    if not chosen or not set(chosen) <= set("GDOM") or rest is None:
        return gather(recording, body, kinds=chosen, root=root, rate_hz=options.rate_hz)
    data = gather(recording, body, kinds=chosen + "A", root=root, rate_hz=options.rate_hz)
    parts = data.gyroscope, data.orientation, data.range_distance
    known = any(np.isfinite(np.asarray(part)).any() for part in parts)
    time = np.asarray(data.time)
    held = (time >= rest.start) & (time <= rest.end) & known  # alone they are no measurement
    force = np.where(held[:, None, None], np.asarray(data.accelerometer), np.nan)
    return dataclasses.replace(data, accelerometer=force)
