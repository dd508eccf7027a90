"""Gyroscope biases as the rest hold reads them (Vlasic 2007, section 5.4)."""

from __future__ import annotations

import numpy as np

from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.levels import constant_cells
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.initialise import RestOptions
from mocap_jax.initialise.still import within
from mocap_jax.measurement import FrameData
from mocap_jax.recording import Recording

# A hold of fewer readings is none; a larger mean rate is a turning person, not a bias [rad/s].
_FEWEST, _LARGEST = 10, 0.15


def rest_biases(
    recording: Recording, data: FrameData, layout: Layout, options: OptimiseOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Readings of the constants from the declared rest hold, and their inverse variances (m,).

    A person who holds still turns by little in all, so a gyroscope's mean reading over the hold is
    its bias, to `still_turn` over the duration. Zero information where a gyroscope was not read or
    not still.
    """
    values, information = np.zeros(layout.constants), np.zeros(layout.constants)
    turn = options.constants.still_turn
    rest = recording.setup.rest
    if rest is None or rest.end <= rest.start or not layout.use_border or turn <= 0:
        return values, information
    white = recording.setup.noise.gyroscope
    cells = constant_cells(layout)["gyroscope_bias"].reshape(-1, 3)
    for name, at in zip(data.sensors, cells, strict=True):
        stream = recording.inertial[name]
        held = within(stream, rest.start, rest.end)
        time, rate = np.asarray(stream.time)[held], np.asarray(stream.gyroscope)[held]
        known = np.isfinite(rate).all(axis=1)
        time, rate = time[known], rate[known]
        if len(time) < _FEWEST or rate.std(axis=0).max() > RestOptions().still_rate:
            continue
        values[at] = rate.mean(axis=0)
        variance = (turn / (time[-1] - time[0])) ** 2 + white**2 / len(time)
        if np.abs(values[at]).max() < _LARGEST:
            information[at] = 1 / variance
    return values, information


def read_in_the_hold(built: Built) -> np.ndarray | None:
    """What `rest_biases` are readings of (m, m): of biases that walk, their mean over the hold."""
    layout = built.layout
    if built.walk is None or not layout.gyroscope_steps or not len(built.rest_frames):
        return None
    out, cells = np.eye(layout.constants), constant_cells(layout)
    held = np.kron(built.walk.at_frames[built.rest_frames].mean(axis=0), np.eye(3))
    biases = cells["gyroscope_bias"].reshape(-1, 3)
    for at, steps in zip(biases, cells["gyroscope_walk"].reshape(len(biases), -1), strict=True):
        out[np.ix_(at, steps)] = held
    return out
