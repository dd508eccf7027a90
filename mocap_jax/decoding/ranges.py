"""Arrivals on all wires to the range stream, and who is not heard."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jax import device_put
from jax.typing import ArrayLike
from jaxtyping import Float

from mocap_jax.body.site_names import ANCHOR_PREFIX
from mocap_jax.decoding.bands import FrequencyBands
from mocap_jax.decoding.pulses import Pulses
from mocap_jax.decoding.reach import longest_distances
from mocap_jax.recording import DriverBox, RangeStream, Recording
from mocap_jax.signals.ultrasonic.distances import measure
from mocap_jax.signals.wire import WireDecoder

_LEAST_SENT, _LEAST_HEARD = 0.1, 0.02
"""Sums of confidences over the pulses: sources and anchors that have less are named. What comes
from beyond a slot is too faint for the place that it seems to have, but for some."""


def wire_ranges(
    rest: Recording,
    box: DriverBox,
    pulses: Pulses,
    bands: FrequencyBands,
    wires: Mapping[str, tuple[WireDecoder, ...]],
    *,
    speed: Float[np.ndarray, "n r"],
    farthest: float,
) -> tuple[RangeStream, int]:
    """Distances of all pairs, in order of emission, and how many pulses were heard.

    Args:
        rest: the recording but for its wires.
        box: figures of the driver box.
        pulses: all emissions.
        bands: frequencies of the sources.
        wires: the unbroken stretches of each.
        speed: of sound at each pulse, for each wire [m/s].
        farthest: longer distances are not believed [m].
    """
    time, names = pulses.time, tuple(wires)
    source, source_names = pulses.sources(rest.setup.sources)
    delay = np.full((len(time), len(names)), np.nan)
    amplitude, deviation = np.full_like(delay, np.nan), np.full_like(delay, np.nan)
    for r, stretches in enumerate(wires.values()):
        for stretch in stretches:
            found = stretch.arrivals()
            delay[found.pulse, r] = found.delay
            amplitude[found.pulse, r] = found.amplitude / box.reference
            deviation[found.pulse, r] = found.deviation
    offset = np.array([box.source_offset_m.get(name, 0.0) for name in source_names])
    out = measure(
        time, source, delay, amplitude, speed, offset,
        farthest=np.minimum(farthest, longest_distances(rest, source_names, names)),
        deviation=deviation, nominal=rest.setup.noise.range, frequency=bands.of(source_names),
    )  # fmt: skip
    pulse, receiver = np.nonzero(out.confidence > 0)
    ranges = RangeStream(
        time=device_put(time[pulse]),
        source=device_put(source[pulse]),
        receiver=device_put(receiver),
        distance=device_put(out.distance[pulse, receiver]),
        confidence=device_put(out.confidence[pulse, receiver]),
        source_names=source_names,
        receiver_names=names,
    )
    return ranges, int(np.isfinite(delay).sum())


def silent(
    ranges: RangeStream, pulses: Pulses, interval: float, farthest: float
) -> tuple[str, ...]:
    """Which sources are hardly heard and which anchors hardly hear, in sentences.

    (A board may well hear nothing: that of the head is above all sources of the standard suit.)

    Args:
        ranges: of all pairs.
        pulses: all emissions.
        interval: between pulses of one frequency [s].
        farthest: longest distance that is looked for [m].
    """
    index, _ = pulses.sources(ranges.source_names)
    sounded = np.bincount(index, minlength=len(ranges.source_names))
    source = _sums(ranges.source, ranges.confidence, len(ranges.source_names))
    wire = _sums(ranges.receiver, ranges.confidence, len(ranges.receiver_names))
    unheard = [
        name
        for name, heard, count in zip(ranges.source_names, source, sounded, strict=True)
        if heard < _LEAST_SENT * count
    ]
    pairs = zip(ranges.receiver_names, wire, strict=True)
    deaf = [
        name
        for name, heard in pairs
        if name.startswith(ANCHOR_PREFIX) and heard < _LEAST_HEARD * sounded.sum()
    ]
    slot = f"(slots of {1e3 * interval:g} ms hear {farthest:.3g} m)"
    out = [f"hardly heard: {', '.join(unheard)} {slot}"] if unheard else []
    return (*out, f"hears hardly anything: {', '.join(deaf)} {slot}") if deaf else tuple(out)


def _sums(index: ArrayLike, values: ArrayLike, count: int) -> Float[np.ndarray, "c"]:
    return np.bincount(np.asarray(index), np.asarray(values), count)
