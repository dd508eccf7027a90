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

_FAINT = 0.15
"""Mean confidence of an anchor's distances below which it is named. What comes from beyond a slot
is too faint for the place that it seems to have, and has a tenth of this."""
_RARE = 0.02
"""Sum of confidences over the pulses below which an anchor or a worn source is named: silence has
0.003, since one in a hundred slots of noise has a peak of 4 noise amplitudes."""


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
    """Which sources are not heard, and which anchors hardly hear or are heard, in sentences.

    (A board may well hear nothing: that of the head is above all sources of the standard suit.)

    Args:
        ranges: of all pairs.
        pulses: all emissions.
        interval: between pulses of one frequency [s].
        farthest: longest distance that is looked for [m].
    """
    counts = np.bincount(pulses.sources(ranges.source_names)[0], minlength=len(ranges.source_names))
    dead, faint = [], []
    for s, name in enumerate(ranges.source_names):
        heard = _confidences(ranges.source, ranges, s)
        if name.startswith(ANCHOR_PREFIX):
            faint += [name] if counts[s] and _is_faint(heard, counts[s]) else []
        elif heard.sum() < _RARE * counts[s]:
            dead.append(name)
    for r, name in enumerate(ranges.receiver_names):
        heard, count = _confidences(ranges.receiver, ranges, r), counts.sum()
        if name.startswith(ANCHOR_PREFIX) and count and _is_faint(heard, count):
            faint.append(name)
    out = [f"no wire hears {', '.join(dead)}"] if dead else []
    if faint:
        slot = f"slots of {1e3 * interval:g} ms hear {farthest:.3g} m"
        out.append(f"{', '.join(faint)}: hardly any distance is to be trusted ({slot})")
    return tuple(out)


def _is_faint(confidence: Float[np.ndarray, "k"], pulses: int) -> bool:
    return bool(confidence.mean() < _FAINT or confidence.sum() < _RARE * pulses)


def _confidences(index: ArrayLike, ranges: RangeStream, which: int) -> Float[np.ndarray, "k"]:
    """Of the distances of one source or receiver; a 0 where there are none."""
    own = np.asarray(ranges.confidence)[np.asarray(index) == which]
    return own if own.size else np.zeros(1)
