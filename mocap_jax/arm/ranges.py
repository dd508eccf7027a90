"""Ranges of one mobile to fixed anchors, as a table; temperature compensation (eq. 1)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mocap_jax.body import load_body
from mocap_jax.body.site_names import ANCHOR_PREFIX
from mocap_jax.errors import InputError
from mocap_jax.recording import Recording
from mocap_jax.signals.ultrasonic.air import speed_of_sound


class PulseRanges(NamedTuple):
    """Ranges by pulse and anchor."""

    time: Float[np.ndarray, "t"]
    """Of the pulses [s]."""
    distance: Float[np.ndarray, "t k"]
    """[m]; NaN where an anchor heard nothing for sure."""
    anchors: Float[np.ndarray, "k 3"]
    """Positions in the world [m]."""
    names: tuple[str, ...]


def compensated(
    time_of_flight: Float[np.ndarray, "*t"], celsius: Float[np.ndarray, "*t"] | float
) -> Float[np.ndarray, "*t"]:
    """Distances [m] from times of flight [s] and the anchors' own temperatures (eq. 1)."""
    return np.asarray(speed_of_sound(celsius) * np.asarray(time_of_flight))


def anchor_ranges(
    recording: Recording, source: str = "source/wrist", least_confidence: float = 0.5
) -> PulseRanges:
    """The ranges of one mobile to all anchors.

    Args:
        recording: with `anchor/...` sites in its body.
        source: the mobile's site.
        least_confidence: detections below it are left out. A receiver without confidences, as the
            paper's, has a threshold instead; the general estimators weigh by confidence.

    Raises:
        InputError: no ranges of that source, or none to an anchor.
    """
    stream = recording.ranges
    if stream is None or source not in stream.source_names:
        names = () if stream is None else stream.source_names
        raise InputError(f"no ranges of '{source}'; sources in the recording: {', '.join(names)}")
    if recording.body_xml is None:
        raise InputError("the recording carries no body.xml, which places the anchors")
    body = load_body(recording.body_xml)
    names = tuple(n for n in stream.receiver_names if n.startswith(ANCHOR_PREFIX))
    if not names:
        raise InputError("no anchor among the receivers: " + ", ".join(stream.receiver_names))
    column = np.array([names.index(n) if n in names else -1 for n in stream.receiver_names])
    place = column[np.asarray(stream.receiver)]
    mine = np.asarray(stream.source) == stream.source_names.index(source)
    sure = np.asarray(stream.confidence)
    used = np.flatnonzero((place >= 0) & mine & (sure >= least_confidence))
    time, row = np.unique(np.asarray(stream.time)[used], return_inverse=True)
    distance = np.full((len(time), len(names)), np.nan)
    distance[row, place[used]] = np.asarray(stream.distance)[used]
    at = np.array([np.asarray(body.site_pos)[body.site_index(n)] for n in names])
    return PulseRanges(time, distance, at, names)
