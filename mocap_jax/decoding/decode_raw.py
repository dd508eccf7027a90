"""`decode_raw`: the driver box's samples to a recording, piece by piece."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from jax import device_put

from mocap_jax.decoding.air import AirOptions, speed_at
from mocap_jax.decoding.bands import FrequencyBands, frequency_bands
from mocap_jax.decoding.inertial import BoardSummary, inertial_stream, with_round_off
from mocap_jax.decoding.pulses import Pulses
from mocap_jax.decoding.reach import longest_distances
from mocap_jax.errors import InputError
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io.raw_file import RawReader
from mocap_jax.io.topics import ACOUSTIC, DRIVER_BOX
from mocap_jax.recording import DriverBox, RangeStream, Recording, SensorSpec, calibrated
from mocap_jax.signals.telemetry.converter import ConverterScales
from mocap_jax.signals.ultrasonic.arrivals import DetectorOptions
from mocap_jax.signals.ultrasonic.bands import SAMPLE_RATE_HZ
from mocap_jax.signals.ultrasonic.distances import measure
from mocap_jax.signals.wire import Emissions, WireDecoder

_ANCHOR = "anchor/"
"""Wires of receivers in the world begin so; they carry sound alone."""


@dataclass(frozen=True)
class Gap:
    """Samples that are not there."""

    wire: str
    start: float
    """[s]"""
    end: float
    """[s]"""


@dataclass(frozen=True)
class Decoded:
    """What came out."""

    recording: Recording
    boards: dict[str, BoardSummary]
    heard: int
    """Pulses heard, of all pairs."""
    slots: int
    """Pulses times microphones."""
    gaps: tuple[Gap, ...]
    """Breaks in the wires' samples."""
    missing_pulses: int
    """Emissions that the recording should name between those it names."""
    remarks: tuple[str, ...] = ()
    """On frequencies of unknown sources, and those that are too near to each other."""


@dataclass
class _Wire:
    """The unbroken stretches of a wire."""

    silent: bool
    """Without telemetry."""
    stretches: list[WireDecoder] = field(default_factory=list)
    breaks: list[tuple[float, float]] = field(default_factory=list)
    """Between them [s]."""

    def at(self, start: float, bands: FrequencyBands, emissions: Emissions) -> WireDecoder:
        """The stretch that samples from a time on belong to.

        Raises:
            InputError: there are samples of that time already.
        """
        last = self.stretches[-1] if self.stretches else None
        if last is not None and abs(last.end - start) <= 0.5 / SAMPLE_RATE_HZ:
            return last
        if last is not None:
            if start < last.end:
                raise InputError(f"samples of {start:.6f} s come behind those of {last.end:.6f} s")
            self.breaks.append((last.end, start))
            last.finish(emissions.until(last.end, inclusive=False))
        self.stretches.append(WireDecoder(bands.detectors, start, silent=self.silent))
        return self.stretches[-1]


def decode_raw(
    path: str | os.PathLike[str],
    options: DetectorOptions | None = None,
    *,
    air: AirOptions | None = None,
    workers: int = 2,
    progress: Callable[[int, int], None] | None = None,
) -> Decoded:
    """Decode a raw recording in bounded memory.

    Frames that cannot be corrected and pulses that are not heard are missing from the result, not
    guessed. A break in a wire's samples is a gap in both. What comes out is corrected by the
    calibration that the set-up holds.

    Args:
        path: raw MCAP file.
        options: of the detector.
        air: its temperature and humidity, where the recording does not tell them.
        workers: threads that decode wires side by side.
        progress: called with bytes read and bytes in all.

    Raises:
        InputError: not a raw recording, sampled at another rate, or not in the order of time.
    """
    reader = RawReader(path)
    wires = dict[str, _Wire]()
    decoder: _Decoder | None = None
    with ThreadPoolExecutor(max(1, workers)) as pool:
        batch: dict[str, tuple[float, np.ndarray]] = {}
        for topic, payload in reader.messages():
            decoder = decoder or _Decoder(path, reader.driver_box(), options)
            name = topic[len(ACOUSTIC) :]
            if not topic.startswith(ACOUSTIC):
                stamp, source = pb.decode_pulse(payload)
                decoder.pulses.add((stamp - reader.start_utc_ns) / 1e9, source)
                continue
            if name in batch:
                _feed(pool, decoder, wires, batch)
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
        _feed(pool, decoder, wires, batch)
        emissions = decoder.pulses.emissions
        list(pool.map(lambda w: w.stretches[-1].finish(emissions), wires.values()))
    return _assembled(reader, decoder, wires, air or AirOptions())


class _Decoder:
    """The pulses and the detectors that all wires share."""

    def __init__(
        self, path: str | os.PathLike[str], box: DriverBox, options: DetectorOptions | None
    ) -> None:
        self.path, self.box = path, box
        self.options = options or DetectorOptions()
        try:
            self.bands = frequency_bands(box, self.options)
        except InputError as error:
            raise InputError(f"{path}: {DRIVER_BOX}: {error}") from error
        self.pulses = Pulses(self.bands.index)


def _feed(
    pool: ThreadPoolExecutor,
    decoder: _Decoder,
    wires: dict[str, _Wire],
    batch: dict[str, tuple[float, np.ndarray]],
) -> None:
    """Decode one piece of each wire, side by side; empties the batch."""
    emissions = decoder.pulses.emissions

    def one(name: str) -> None:
        start, samples = batch[name]
        try:
            stretch = wires[name].at(start, decoder.bands, emissions)
        except InputError as error:
            raise InputError(f"{decoder.path}: {ACOUSTIC}{name}: {error}") from error
        stretch.feed(samples, emissions)

    for name in batch:
        wires.setdefault(name, _Wire(name.startswith(_ANCHOR)))
    list(pool.map(one, batch))
    batch.clear()


def _assembled(
    reader: RawReader,
    decoder: _Decoder,
    wires: dict[str, _Wire],
    air: AirOptions,
) -> Decoded:
    rest, box, pulses = reader.recording(), decoder.box, decoder.pulses
    scales = ConverterScales(box.accelerometer_full_scale, box.gyroscope_full_scale)
    streams, boards = {}, {}
    own = {name: wire for name, wire in wires.items() if not wire.silent}
    for name, wire in own.items():
        streams[name], boards[name] = inertial_stream([w.frames() for w in wire.stretches], scales)
    speed = speed_at(rest, pulses.time, air)
    ranges, heard = _ranges(rest, decoder, wires, speed)
    facts = rest.setup.provenance | {"detector": decoder.options.detector, "decoded": True}
    given = {"air_celsius": air.celsius, "air_humidity": air.humidity}
    facts |= {name: value for name, value in given.items() if value is not None}
    sensors = rest.setup.sensors or tuple(SensorSpec(name, name, 140.0) for name in own)
    setup = replace(
        rest.setup,
        provenance=facts,
        sensors=sensors,
        noise=with_round_off(rest.setup.noise, scales),
    )
    if speed.size:
        setup = replace(setup, speed_of_sound=float(speed.mean()))
    recording = calibrated(replace(rest, inertial=streams, ranges=ranges, setup=setup))
    slots = len(pulses.time) * len(wires)
    gaps = tuple(Gap(name, *ends) for name, wire in wires.items() for ends in wire.breaks)
    missing = pulses.missing(rest.setup.pulse_interval)
    unknown = decoder.bands.strangers(pulses.sources(rest.setup.sources)[1])
    remarks = tuple(f"{DRIVER_BOX}: {text}" for text in unknown)
    remarks += decoder.bands.remarks(pulses.sources(())[1])
    return Decoded(recording, boards, heard, slots, gaps, missing, remarks)


def _ranges(
    rest: Recording,
    decoder: _Decoder,
    wires: dict[str, _Wire],
    speed: np.ndarray,
) -> tuple[RangeStream, int]:
    """Distances of all pairs, in order of emission."""
    time, names = decoder.pulses.time, tuple(wires)
    source, source_names = decoder.pulses.sources(rest.setup.sources)
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
        time, source, delay, amplitude, speed, offset,
        farthest=farthest, deviation=deviation, nominal=rest.setup.noise.range,
        frequency=decoder.bands.of(source_names),
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
