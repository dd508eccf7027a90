"""Arrivals on all wires to the range stream."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jax import device_put
from jaxtyping import Float

from mocap_jax.decoding.bands import FrequencyBands
from mocap_jax.decoding.pulses import Pulses
from mocap_jax.decoding.reach import longest_distances
from mocap_jax.recording import DriverBox, RangeStream, Recording
from mocap_jax.signals.ultrasonic.distances import measure
from mocap_jax.signals.wire import WireDecoder


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
