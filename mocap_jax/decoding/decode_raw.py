"""`decode_raw`: the driver box's samples to a recording, piece by piece."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from mocap_jax.decoding.air import AirOptions, by_wire, speed_at
from mocap_jax.decoding.bands import FrequencyBands, frequency_bands
from mocap_jax.decoding.inertial import BoardSummary, inertial_stream, with_round_off
from mocap_jax.decoding.pulses import Pulses
from mocap_jax.decoding.ranges import wire_ranges
from mocap_jax.decoding.unheard import sentences, without_faint_anchors
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io.raw_file import RawReader
from mocap_jax.io.topics import ACOUSTIC, DRIVER_BOX
from mocap_jax.recording import DriverBox, SensorSpec, Setup, calibrated
from mocap_jax.signals.telemetry.converter import ConverterScales
from mocap_jax.signals.ultrasonic.arrivals import DetectorOptions
from mocap_jax.signals.ultrasonic.bands import SAMPLE_RATE_HZ
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
    unheard: tuple[str, ...] = ()
    """Which worn sources are not heard, and which anchors were left out, in sentences."""


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
            decoder = decoder or _Decoder(path, reader.driver_box(), reader.setup(), options)
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
        self,
        path: str | os.PathLike[str],
        box: DriverBox,
        setup: Setup,
        options: DetectorOptions | None,
    ) -> None:
        self.path, self.box, self.interval = path, box, setup.pulse_interval
        self.options = (options or DetectorOptions()).in_slots(setup.pulse_interval)
        try:
            self.bands = frequency_bands(box, self.options)
        except InputError as error:
            raise InputError(f"{path}: {DRIVER_BOX}: {error}") from error
        self.pulses = Pulses(self.bands.index)

    @property
    def farthest(self) -> float:
        """Longest distance that is looked for [m]."""
        assert self.options.farthest_m is not None  # of `in_slots`
        return self.options.farthest_m

    def check_names(self, declared: tuple[str, ...], wires: tuple[str, ...]) -> None:
        """Refuse figures of what is not there, once all pulses have named their sources.

        Raises:
            InputError: naming the figure.
        """
        self._check("source_offset_m", self.box.source_offset_m, self.pulses.sources(declared)[1])
        self._check("receiver_celsius", self.box.receiver_celsius, wires)

    def _check(self, table: str, names: Iterable[str], valid: tuple[str, ...]) -> None:
        for name in names:
            if name not in valid:
                raise unknown_name(f"{self.path}: {DRIVER_BOX}: name in {table}:", name, valid)


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
    decoder.check_names(rest.setup.sources, tuple(wires))
    stretches = {name: tuple(wire.stretches) for name, wire in wires.items()}
    ranges, heard = wire_ranges(
        rest, box, pulses, decoder.bands, stretches,
        speed=by_wire(speed, tuple(wires), box.receiver_celsius, air),
        farthest=decoder.farthest,
    )  # fmt: skip
    ranges, faint = without_faint_anchors(ranges, pulses)
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
    unheard = sentences(ranges, pulses, faint, decoder.interval, decoder.farthest)
    return Decoded(recording, boards, heard, slots, gaps, missing, remarks, unheard)
