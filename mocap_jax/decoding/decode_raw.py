"""`decode_raw`: the driver box's samples to a recording, piece by piece."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from jax import device_put

from mocap_jax.decoding.inertial import BoardSummary, inertial_stream
from mocap_jax.decoding.pulses import Pulses
from mocap_jax.decoding.reach import longest_distances
from mocap_jax.errors import InputError
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io.raw_file import RawReader
from mocap_jax.io.topics import ACOUSTIC
from mocap_jax.recording import DriverBox, NoiseFigures, RangeStream, Recording, SensorSpec
from mocap_jax.signals.telemetry.converter import ConverterScales
from mocap_jax.signals.ultrasonic.air import speed_of_sound
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, DetectorOptions
from mocap_jax.signals.ultrasonic.bands import SAMPLE_RATE_HZ
from mocap_jax.signals.ultrasonic.burst import Transducer
from mocap_jax.signals.ultrasonic.distances import measure
from mocap_jax.signals.wire import BLOCK_SAMPLES, WireDecoder

_NOMINAL_SPEED = 343.0
"""For what is only roughly needed: where a slot ends."""


@dataclass(frozen=True)
class Decoded:
    """What came out."""

    recording: Recording
    boards: dict[str, BoardSummary]
    heard: int
    """Pulses heard, of all pairs."""
    slots: int
    """Pulses times microphones."""


@dataclass
class _Wire:
    """The unbroken stretches of a wire."""

    stretches: list[WireDecoder] = field(default_factory=list)


def decode_raw(
    path: str | os.PathLike[str],
    options: DetectorOptions | None = None,
    *,
    workers: int = 2,
    progress: Callable[[int, int], None] | None = None,
) -> Decoded:
    """Decode a raw recording in bounded memory.

    Frames that cannot be corrected and pulses that are not heard are missing from the result, not
    guessed. A break in a wire's samples is a gap in both.

    Args:
        path: raw MCAP file.
        options: of the detector.
        workers: threads that decode wires side by side.
        progress: called with bytes read and bytes in all.

    Raises:
        InputError: not a raw recording, or sampled at another rate.
    """
    reader = RawReader(path)
    pulses, wires = Pulses(), dict[str, _Wire]()
    decoder: _Decoder | None = None
    with ThreadPoolExecutor(max(1, workers)) as pool:
        batch: dict[str, tuple[float, np.ndarray]] = {}
        for topic, payload in reader.messages():
            decoder = decoder or _Decoder(reader.driver_box(), options)
            name = topic[len(ACOUSTIC) :]
            if not topic.startswith(ACOUSTIC):
                stamp, source = pb.decode_pulse(payload)
                pulses.add((stamp - reader.start_utc_ns) / 1e9, source)
                continue
            if name in batch:
                _feed(pool, decoder, wires, batch, pulses)
                if progress is not None:
                    progress(reader.read_bytes, reader.size)
            stamp, rate, samples = pb.decode_waveform(payload)
            if abs(rate - SAMPLE_RATE_HZ) > 1.0:
                raise InputError(
                    f"{path}: {topic}: sampled at {rate:g} Hz; valid: {SAMPLE_RATE_HZ:g} Hz"
                )
            batch[name] = ((stamp - reader.start_utc_ns) / 1e9, samples)
        if decoder is None:
            raise InputError(
                f"{path}: no messages on {ACOUSTIC}<sensor> and /pulse: not a raw recording"
                + "".join(f"; {d}" for d in reader.damage)
            )
        _feed(pool, decoder, wires, batch, pulses)
        list(pool.map(lambda w: w.stretches[-1].finish(pulses.time), wires.values()))
    return _assembled(reader, decoder, wires, pulses)


class _Decoder:
    """The detector that all wires share."""

    def __init__(self, box: DriverBox, options: DetectorOptions | None) -> None:
        self.box = box
        self.options = options or DetectorOptions()
        self.options = replace(self.options, transducer=Transducer(box.resonance_hz, box.quality))
        self.detector = ArrivalDetector(
            self.options, speed=_NOMINAL_SPEED, reference=box.reference, length=BLOCK_SAMPLES
        )


def _feed(
    pool: ThreadPoolExecutor,
    decoder: _Decoder,
    wires: dict[str, _Wire],
    batch: dict[str, tuple[float, np.ndarray]],
    pulses: Pulses,
) -> None:
    """Decode one piece of each wire, side by side; empties the batch."""
    emissions = pulses.time

    def one(name: str) -> None:
        start, samples = batch[name]
        wire = wires[name]
        if wire.stretches and abs(wire.stretches[-1].end - start) > 0.5 / SAMPLE_RATE_HZ:
            wire.stretches[-1].finish(emissions[emissions < wire.stretches[-1].end])
            wire.stretches.append(WireDecoder(decoder.detector, start))
        if not wire.stretches:
            wire.stretches.append(WireDecoder(decoder.detector, start))
        wire.stretches[-1].feed(samples, emissions)

    for name in batch:
        wires.setdefault(name, _Wire())
    list(pool.map(one, batch))
    batch.clear()


def _assembled(
    reader: RawReader, decoder: _Decoder, wires: dict[str, _Wire], pulses: Pulses
) -> Decoded:
    rest, box = reader.recording(), decoder.box
    scales = ConverterScales(box.accelerometer_full_scale, box.gyroscope_full_scale)
    streams, boards = {}, {}
    for name, wire in wires.items():
        streams[name], boards[name] = inertial_stream([w.frames() for w in wire.stretches], scales)
    ranges, heard = _ranges(rest, decoder, wires, pulses)
    facts = rest.setup.provenance | {"detector": decoder.options.detector, "decoded": True}
    sensors = rest.setup.sensors or tuple(SensorSpec(name, name, 140.0) for name in wires)
    setup = replace(
        rest.setup, provenance=facts, sensors=sensors, noise=_coarser(rest.setup.noise, scales)
    )
    recording = replace(rest, inertial=streams, ranges=ranges, setup=setup)
    slots = len(pulses.time) * len(wires)
    return Decoded(recording, boards, heard, slots)


def _coarser(noise: NoiseFigures, scales: ConverterScales) -> NoiseFigures:
    """Noise figures with the round-off of levels, which the carried part makes twice as large."""
    gyroscope, accelerometer = scales.per_level[[0, 3]]
    return replace(
        noise,
        gyroscope=float(np.hypot(noise.gyroscope, gyroscope / np.sqrt(6.0))),
        accelerometer=float(np.hypot(noise.accelerometer, accelerometer / np.sqrt(6.0))),
    )


def _ranges(
    rest: Recording, decoder: _Decoder, wires: dict[str, _Wire], pulses: Pulses
) -> tuple[RangeStream, int]:
    """Distances of all pairs, in order of emission."""
    time, names = pulses.time, tuple(wires)
    source, source_names = pulses.sources(rest.setup.sources)
    delay = np.full((len(time), len(names)), np.nan)
    amplitude, deviation = np.full_like(delay, np.nan), np.full_like(delay, np.nan)
    for r, wire in enumerate(wires.values()):
        for stretch in wire.stretches:
            found = stretch.arrivals()
            delay[found.pulse, r] = found.delay
            amplitude[found.pulse, r] = found.amplitude / decoder.box.reference
            deviation[found.pulse, r] = found.deviation
    known = decoder.box.source_offset_m
    offset = np.array([known.get(name, 0.0) for name in source_names])
    farthest = np.minimum(decoder.options.farthest_m, longest_distances(rest, source_names, names))
    out = measure(
        time, source, delay, amplitude, _speed(rest, time), offset,
        farthest=farthest, deviation=deviation, nominal=rest.setup.noise.range,
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


def _speed(rest: Recording, time: np.ndarray) -> np.ndarray:
    """Speed of sound at the given times [m/s]: by temperature where it was measured."""
    air = rest.temperature
    if air is None or not len(air.time):
        return np.full(len(time), rest.setup.speed_of_sound)
    return speed_of_sound(np.interp(time, np.asarray(air.time), np.asarray(air.celsius)))
