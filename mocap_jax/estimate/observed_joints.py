"""Which joints the measurements in use observe."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.measurement import FrameData
from mocap_jax.metrics import observed_segments


def observed_joints(body: Body, data: FrameData) -> tuple[str, ...]:
    """Child segments of the joints that the sensors with any usable reading observe.

    A board counts when one of its inertial readings is used, or when its microphone hears a
    source; the rule for joints is that of `metrics.observed_segments`.
    """
    readings = (data.accelerometer, data.gyroscope, data.orientation)
    heard = {int(s) for s in np.unique(np.asarray(data.range_receiver)[data.range_weight > 0])}
    moving = {
        site
        for i, site in enumerate(data.sites)
        if any(np.isfinite(np.asarray(reading)[:, i]).all(axis=-1).any() for reading in readings)
    }
    return observed_segments(body, sorted(heard | moving))
