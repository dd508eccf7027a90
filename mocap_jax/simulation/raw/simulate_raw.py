"""`simulate_raw`: a known motion to the driver box's recording, in bounded memory."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from jax import device_put
from jaxtyping import Float, Int16

from mocap_jax.errors import InputError
from mocap_jax.io.raw_file import Piece, write_raw
from mocap_jax.motion import Motion
from mocap_jax.recording import (
    Calibration,
    DriverBox,
    InertialStream,
    Recording,
    Setup,
    TemperatureStream,
    uncalibrated,
)
from mocap_jax.signals.telemetry.converter import ConverterScales
from mocap_jax.signals.telemetry.frame import FRAME_RATE_HZ
from mocap_jax.signals.ultrasonic.air import temperature
from mocap_jax.simulation.flight import trace
from mocap_jax.simulation.inertial import sample_inertial, sample_times
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.profiles import Profile, profile_named
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.ranging import (
    offset_parameters,
    thermometer_errors,
    thermometer_parameters,
    true_offsets,
    true_speed,
)
from mocap_jax.simulation.raw.amplifier import PASSED_HZ
from mocap_jax.simulation.raw.boards import Board, make_board
from mocap_jax.simulation.raw.noise import WireNoise
from mocap_jax.simulation.raw.options import RawOptions
from mocap_jax.simulation.raw.paths import trace_paths
from mocap_jax.simulation.raw.sound import Resonator, SoundField
from mocap_jax.simulation.raw.transducer import SAMPLE_RATE_HZ
from mocap_jax.simulation.root_pose import sample_root
from mocap_jax.simulation.stage import Stage, declared_setup, set_stage
from mocap_jax.simulation.suit import BURST_HZ, Suit

_QUALITY = 20.0
_KELVIN = 273.15


@dataclass(frozen=True)
class RawSimulation:
    """What the driver box recorded, its samples made as they are asked for."""

    recording: Recording
    """All but the measurements on the wires: set-up, body, root, temperature, truth."""
    sample_rate_hz: float
    wires: tuple[str, ...]
    """Names of the boards, and sites of the anchors that receive, whose wires carry sound alone."""
    pulse_time: Float[np.ndarray, "n"]
    """Of emission [s]."""
    pulse_source: np.ndarray
    """Index into the set-up's sources, shape (n,)."""
    distance: Float[np.ndarray, "n r"]
    """True ones, from emission to arrival [m]."""
    visible: np.ndarray
    """Whether the direct way is free and in front of the source, shape (n, r)."""
    boards: tuple[Board, ...]
    _field: SoundField
    _frequencies: tuple[float, ...]
    _options: RawOptions
    _ambient: float
    _seed: int
    duration: float
    """[s]"""
    _thermometers: dict[str, float] = field(default_factory=dict)

    @property
    def box(self) -> DriverBox:
        """Figures that decoding needs, as declared."""
        named = zip(self.recording.setup.sources, self._frequencies, strict=True)
        others = {site: f for site, f in named if f != BURST_HZ}
        return DriverBox(
            reference=self._options.reference,
            source_frequency_hz=others,
            receiver_celsius=self._thermometers,
        )

    @property
    def pieces(self) -> int:
        """Number of chunks."""
        size = round(self._options.chunk_s * SAMPLE_RATE_HZ)
        return -(-int(self.duration * SAMPLE_RATE_HZ) // size)

    def chunks(self) -> Iterator[tuple[int, Int16[np.ndarray, "r count"]]]:
        """Index of the first sample, and the samples of all wires."""
        size = round(self._options.chunk_s * SAMPLE_RATE_HZ)
        total = int(self.duration * SAMPLE_RATE_HZ)
        opts = self._options
        noise = WireNoise(
            self._ambient * opts.reference, opts.converter_noise, opts.interference,
            len(self.wires), stream(self._seed, "raw_noise"),
        )  # fmt: skip
        for first in range(0, total, size):
            count = min(size, total - first)
            wire = opts.reference * self._field.samples(first, count)
            wire += noise.samples(first, count)
            for r, board in enumerate(self.boards):  # whose wires come first
                wire[r] += opts.telemetry * board.volts(first, count)
            yield first, np.clip(np.rint(wire), -32768, 32767).astype(np.int16)

    def write(self, path: str | os.PathLike[str], pieces: Iterable[Piece] | None = None) -> None:
        """Write the raw recording, whole or not at all.

        Args:
            path: the file.
            pieces: default `chunks()`; for example with a progress bar around them.

        Raises:
            InputError: the file cannot be written.
        """
        write_raw(
            path, self.recording, self.box, sample_rate_hz=self.sample_rate_hz, wires=self.wires,
            pulse_time=self.pulse_time, pulse_source=self.pulse_source,
            pieces=self.chunks() if pieces is None else pieces,
        )  # fmt: skip


def simulate_raw(
    motion: Motion,
    *,
    profile: str | Profile = "paper",
    seed: int = 0,
    suit: Suit | None = None,
    options: SimulationOptions | None = None,
    raw: RawOptions | None = None,
    calibration: Calibration | None = None,
) -> RawSimulation:
    """Simulate the wires of a suit while a body performs a known motion.

    Every microphone hears the sources of all frequencies; telling them apart is the decoder's.
    Bodies, motion, occlusion, speed of sound, offsets and the sensors' own errors are those of
    `simulate` with the same seed. What only radio-connected boards suffer (lost samples, clock
    offsets) does not happen on wires.

    Args:
        motion: clip and body, with a free root.
        profile: `ideal` (direct sound only), `paper`, `field`, or one of your own.
        seed: of all randomness.
        suit: boards and sources; default the standard suit fitted to the body.
        options: durations, rates, cut-off.
        raw: levels on the wires, and the room.
        calibration: as for `simulate`.

    Raises:
        InputError: as `simulate`; a suit without sources; boards of another frame rate; bursts of
            a frequency that the amplifier does not pass.
    """
    options = SimulationOptions() if options is None else options
    raw = RawOptions() if raw is None else raw
    errs = profile if isinstance(profile, Profile) else profile_named(profile)
    if options.inertial_rate_hz != FRAME_RATE_HZ:
        raise InputError(
            f"inertial_rate_hz {options.inertial_rate_hz:g}: telemetry has {FRAME_RATE_HZ:g} Hz"
        )
    stage = set_stage(motion, errs, seed, suit, options)
    _check_suit(stage.suit)
    time = sample_times(stage.duration, options.inertial_rate_hz)
    exact = replace(errs, white=False, loss=0.0, clock_offset=0.0)
    means, more = (
        sample_inertial(stage.rig, stage.spline, stage.boards, time, exact, seed)
        if stage.boards
        else ({}, {})
    )
    setup = declared_setup(motion, stage.suit, stage.performance, errs, options, seed, calibration)
    means = _as_read(means, setup)
    scales = ConverterScales()
    boards = tuple(
        make_board(name, means[name], stage.duration, errs, scales, raw.clock_ppm, seed)
        for name in stage.boards
    )
    return _assembled(motion, stage, errs, options, raw, seed, boards, more, setup)


def _check_suit(suit: Suit) -> None:
    """Refuse what a driver box cannot record; raises `InputError`."""
    if not suit.source_sites:
        raise InputError("the suit has no ultrasonic sources; a raw recording needs at least one")
    low, high = PASSED_HZ
    for site, frequency in zip(suit.source_sites, suit.frequencies, strict=True):
        if not low <= frequency <= high:
            raise InputError(
                f"{site}: bursts of {frequency:g} Hz; the driver box's amplifier passes {low:g} to "
                f"{high:g} Hz"
            )


def _as_read(means: dict[str, InertialStream], setup: Setup) -> dict[str, InertialStream]:
    """Readings before the set-up's calibration."""
    bare = Recording(means, None, None, {}, None, None, setup, None)
    return uncalibrated(bare).inertial


def _assembled(
    motion: Motion,
    stage: Stage,
    errs: Profile,
    options: SimulationOptions,
    raw: RawOptions,
    seed: int,
    boards: tuple[Board, ...],
    parameters: dict[str, np.ndarray],
    setup: Setup,
) -> RawSimulation:
    speed, offset = true_speed(errs, options, seed), true_offsets(stage.suit, errs, seed)
    frequencies = stage.suit.frequencies
    # As in the direct simulation, the last pulse arrives before the motion ends.
    end = stage.spline.end - options.max_range_m / speed - options.pulse_interval_s
    flights, emissions = trace(
        stage.rig, stage.spline, end=end, pulse_interval=options.pulse_interval_s,
        speed_of_sound=speed, frequencies=frequencies,
    )  # fmt: skip
    paths = trace_paths(
        stage.rig, stage.spline, flights, emissions, errs, raw, speed, seed, frequencies
    )
    detuned = raw.detune_hz * stream(seed, "raw_resonance").standard_normal(len(offset))
    excess = offset + [setup.calibration.offset_of(s) for s in stage.suit.source_sites]
    sound = SoundField(
        flights.time, flights.source, paths, speed, excess / options.speed_of_sound,
        [Resonator(f + d, _QUALITY, f) for f, d in zip(frequencies, detuned, strict=True)],
    )  # fmt: skip
    time = sample_times(stage.duration, options.inertial_rate_hz)
    wrong = thermometer_errors(stage.suit, errs, seed)
    parameters = parameters | offset_parameters(stage.suit, offset) | thermometer_parameters(wrong)
    truth, q = stage.truth(time, parameters | {"speed_of_sound": np.array(speed)})
    # The thermometer's error is what makes the declared speed of sound wrong.
    air = np.arange(0.0, stage.duration, 1.0)
    celsius = float(temperature(options.speed_of_sound))
    recording = Recording(
        inertial={},
        ranges=None,
        root=sample_root(time, q, errs, seed),
        magnetic={},
        temperature=TemperatureStream(device_put(air), device_put(np.full(len(air), celsius))),
        truth=truth,
        setup=replace(setup, calibration=replace(setup.calibration, applied=False)),
        body_xml=stage.nominal.xml,
        start_utc_ns=options.start_utc_ns,
        subject=motion.name,
    )
    return RawSimulation(
        recording, SAMPLE_RATE_HZ, stage.suit.receiver_names, flights.time, flights.source,
        flights.distance, ~flights.occluded & (flights.cosine > 0), boards, sound, frequencies, raw,
        errs.hearing.noise if errs.detector else 0.0, seed, stage.duration,
        _readings(wrong, celsius, speed) if errs.anchor_temperature else {},
    )  # fmt: skip


def _readings(errors: dict[str, float], celsius: float, speed: float) -> dict[str, float]:
    """What anchors' thermometers read [degrees Celsius], as wrong as in the direct simulation.

    Args:
        errors: of each [K].
        celsius: reading of the common thermometer.
        speed: the true one of sound [m/s].
    """
    kelvin = float(temperature(speed)) + _KELVIN
    share = (celsius + _KELVIN) / kelvin
    return {name: celsius + share * error for name, error in errors.items()}
