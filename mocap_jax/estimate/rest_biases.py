"""Gyroscope biases as the rest hold reads them (Vlasic 2007, section 5.4)."""

from __future__ import annotations

import numpy as np

from mocap_jax.estimate.sequence.adapt import constant_cells
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.initialise import RestOptions, find_still, rest_readings
from mocap_jax.measurement import FrameData
from mocap_jax.recording import Recording


def rest_biases(
    recording: Recording, data: FrameData, layout: Layout, options: OptimiseOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Readings of the constants from the declared rest hold, and their inverse variances (m,).

    A person who holds still turns by little in all, so a gyroscope's mean reading over the hold is
    its bias, to `still_turn` over the duration. Zero information where there is no reading.
    """
    values, information = np.zeros(layout.constants), np.zeros(layout.constants)
    turn = options.constants.still_turn
    rest = recording.setup.rest
    if rest is None or rest.end <= rest.start or not layout.use_border or turn <= 0:
        return values, information
    still = find_still(recording, RestOptions())
    readings = rest_readings(recording, still, use_root=False)
    order = [list(recording.inertial).index(name) for name in data.sensors]
    rate = readings.rate[order]
    white = recording.setup.noise.gyroscope**2 / readings.count[order]
    variance = (turn / (still.end - still.start)) ** 2 + white
    cells = constant_cells(layout)["gyroscope_bias"]
    known = np.isfinite(rate).all(axis=1, keepdims=True) & np.ones(3, bool)
    values[cells] = np.where(known, rate, 0.0).ravel()
    information[cells] = np.where(known, 1 / variance[:, None], 0.0).ravel()
    return values, information
