"""Anchors farther than sound comes in 8 ms, anchors with thermometers, figures of nobody."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mocap_jax.decoding import AirOptions, decode_raw
from mocap_jax.errors import InputError
from mocap_jax.io.raw_file import RawReader, write_raw
from mocap_jax.recording import DriverBox
from mocap_jax.signals.ultrasonic.arrivals import ArrivalDetector, DetectorOptions
from mocap_jax.signals.wire import BLOCK_SAMPLES
from mocap_jax.simulation import Anchor, SimulationOptions, simulate
from mocap_jax.simulation.profiles import profile_named
from mocap_jax.simulation.raw import RawOptions, simulate_raw

DOWN = (0.0, 1.0, 0.0, 0.0)
HIGH = Anchor("high", (1.0, 0.3, 4.8), DOWN, emits=True)
EAR = Anchor("ear", (1.2, 1.2, 1.4), (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0))
ROOM = RawOptions(floor_m=0.0)


def simulated(motion, suit, interval: float, detector: str, folder, *, max_range=2.75):
    options = SimulationOptions(
        rest_s=0.3, blend_s=0.5, pulse_interval_s=interval, max_range_m=max_range
    )
    raw = simulate_raw(motion, profile="paper", suit=suit, seed=4, options=options, raw=ROOM)
    raw.write(folder / "room.raw.mcap")
    return raw, decode_raw(folder / "room.raw.mcap", DetectorOptions(detector=detector))


@pytest.mark.parametrize("detector", ["matched", "inflection"])
def test_longer_slots_hear_farther(motion, suit, tmp_path, detector: str):
    """A source 3.3 to 4.2 m above the boards: heard in slots of 16 ms, and nobody errs."""
    raw, decoded = simulated(
        motion, replace(suit, anchors=(HIGH,)), 0.016, detector, tmp_path, max_range=5.5
    )
    assert decoded.unheard == ("no wire hears source/back",)
    ranges = decoded.recording.ranges
    pulse = np.searchsorted(raw.pulse_time, np.asarray(ranges.time) - 1e-6)
    receiver = np.asarray(ranges.receiver)
    true = raw.distance[pulse, receiver]
    confidence = np.asarray(ranges.confidence)
    known = (confidence > 0.2) & raw.visible[pulse, receiver]
    error, sigma = (np.asarray(ranges.distance) - true)[known], 0.0025 / confidence[known]
    far = true[known] > 3.0
    assert far.sum() > 200 and (~far).sum() > 60
    assert np.abs(error[far]).max() < 0.05
    assert np.median(np.abs(error[far])) < 0.0075
    assert np.mean((error[far] / sigma[far]) ** 2) < 1.0


def test_what_a_slot_cannot_hear_is_told_and_not_trusted(motion, suit, tmp_path):
    """In slots of 8 ms the same source sounds in the next pulse's slot, too faint for its place."""
    raw, decoded = simulated(motion, replace(suit, anchors=(HIGH,)), 0.008, "matched", tmp_path)
    assert raw.distance[raw.pulse_source == 2].min() > 3.0
    assert decoded.unheard == (
        "no wire hears source/back",
        "anchor/high: too faint, left out (slots of 8 ms hear 2.75 m)",
    )
    ranges = decoded.recording.ranges
    pulse = np.searchsorted(raw.pulse_time, np.asarray(ranges.time) - 1e-6)
    error = np.asarray(ranges.distance) - raw.distance[pulse, np.asarray(ranges.receiver)]
    assert 2 not in np.asarray(ranges.source), "the anchor's are gone"
    trusted = np.asarray(ranges.confidence) > 0.5
    assert trusted.sum() > 100 and np.abs(error[trusted]).max() < 0.015


def test_slots_of_a_detector():
    for interval, farthest, slots in ((0.008, 2.75, 1), (0.02, 6.875, 3), (1.0, 20.0, 8)):
        options = DetectorOptions().in_slots(interval)
        assert options.farthest_m == pytest.approx(farthest)
        detector = ArrivalDetector(options, speed=343.0, reference=3000.0, length=BLOCK_SAMPLES)
        assert detector.slot_samples == 1200 * slots
    assert DetectorOptions(farthest_m=4.0).in_slots(0.008).farthest_m == 4.0
    with pytest.raises(InputError, match=r"farthest_m 30: valid are numbers above 0\.05 up to 20"):
        DetectorOptions(farthest_m=30.0)


def test_thermometers_of_anchors_err_as_in_the_direct_simulation(motion, suit, tmp_path):
    """Each anchor's ranges are turned into metres by its own reading."""
    listening = replace(suit, anchors=(EAR, replace(EAR, name="far", position=(2.2, 0.4, 1.5))))
    options = SimulationOptions(rest_s=0.3, blend_s=0.5)
    profile = replace(profile_named("ideal"), anchor_temperature=8.0, speed_of_sound=0.01)
    given = {"profile": profile, "suit": listening, "seed": 3, "options": options}
    direct = simulate(motion, **given).ranges
    raw = simulate_raw(motion, **given)
    path = tmp_path / "warm.raw.mcap"
    raw.write(path)
    recording = decode_raw(path).recording
    errors = [float(recording.truth.parameters[f"anchor_temperature/anchor/{n}"])
              for n in ("ear", "far")]  # fmt: skip
    assert min(map(abs, errors)) > 0.9
    found = recording.ranges
    true = table(direct)
    difference = np.array([d - true[k] for k, d in table(found).items() if k in true])
    anchored = np.array([k[2] >= 3 for k in table(found) if k in true])
    assert anchored.sum() > 100 and (~anchored).sum() > 50
    assert np.sqrt(np.mean(difference**2)) < 0.001
    plain = table(decode_raw(path, air=AirOptions(celsius=20.0)).recording.ranges)
    ratio = [plain[k] / d for k, d in table(found).items() if k[2] == 3 and k in plain]
    kelvin = raw.box.receiver_celsius["anchor/ear"] + 273.15
    np.testing.assert_allclose(ratio, np.sqrt(293.15 / kelvin), rtol=1e-6)


def table(r) -> dict[tuple[float, int, int], float]:
    columns = (np.rint(np.asarray(r.time) / 0.008), r.source, r.receiver, r.distance)
    rows = zip(*(np.asarray(c).tolist() for c in columns), strict=True)
    return {(t, s, m): d for t, s, m, d in rows}


@pytest.mark.parametrize(
    ("figures", "fault"),
    [
        ({"source_offset_m": {"source/frnot": 0.01}},
         "name in source_offset_m: 'source/frnot'; valid: source/front, source/back"),
        ({"receiver_celsius": {"anchor/ear": 20.0}},
         "name in receiver_celsius: 'anchor/ear'; valid: upper, lower, base|name in "
         "receiver_celsius: 'anchor/ear'; valid: base, upper, lower"),
    ],
)  # fmt: skip
def test_figures_of_what_is_not_there_are_refused(motion, suit, tmp_path, figures, fault):
    options = SimulationOptions(rest_s=0.3, blend_s=0.5)
    raw = simulate_raw(motion, profile="ideal", suit=suit, options=options)
    path = tmp_path / "named.raw.mcap"
    write_raw(
        path, raw.recording, replace(raw.box, **figures), sample_rate_hz=150_000.0,
        wires=raw.wires, pulse_time=raw.pulse_time[:50], pulse_source=raw.pulse_source[:50],
        pieces=[next(raw.chunks())],
    )  # fmt: skip
    with pytest.raises(InputError, match=rf"named\.raw\.mcap: driver_box\.toml: .*({fault})"):
        decode_raw(path)


@pytest.mark.parametrize(
    ("figures", "fault"),
    [
        ({"reference": 0}, "reference: 0; valid: numbers above 0"),
        ({"quality": "high"}, "quality: high; valid"),
        ({"source_offset_m": {"source/front": "1 mm"}}, "source_offset_m of 'source/front': 1 mm"),
        ({"receiver_celsius": 20.0}, "receiver_celsius must be a table of numbers by name"),
        ({"receiver_celsius": {"anchor/ear": 293.15}},
         "receiver_celsius of 'anchor/ear': 293.15; valid: -60 to 60 degrees Celsius"),
        ({"receiver_celsius": {"anchor/ear": -300}}, "receiver_celsius of 'anchor/ear': -300"),
    ],
)  # fmt: skip
def test_wrong_figures_of_a_driver_box(figures, fault):
    with pytest.raises(InputError, match=fault):
        DriverBox(**figures)


def test_a_calibrated_source_that_sounds_need_not_be_declared(motion, suit, tmp_path, monkeypatch):
    """The set-up names one of two sources; the pulses name the other one."""
    options = SimulationOptions(rest_s=0.3, blend_s=0.5)
    raw = simulate_raw(motion, profile="ideal", suit=suit, options=options)
    path, offset = tmp_path / "undeclared.raw.mcap", {"source/back": 0.02}
    write_raw(
        path, raw.recording, replace(raw.box, source_offset_m=offset), sample_rate_hz=150_000.0,
        wires=raw.wires, pulse_time=raw.pulse_time[:50], pulse_source=raw.pulse_source[:50],
        pieces=[next(raw.chunks())],
    )  # fmt: skip
    whole = RawReader.setup
    monkeypatch.setattr(
        RawReader, "setup", lambda reader: replace(whole(reader), sources=("source/front",))
    )
    assert "source/back" in decode_raw(path).recording.ranges.source_names


def test_an_anchor_that_hears_nobody_is_told(motion, suit, tmp_path):
    """A board that hears nobody is not: those may be hidden from all sources."""
    away = Anchor("away", (0.5, -9.0, 1.2))
    _, decoded = simulated(motion, replace(suit, anchors=(away,)), 0.008, "matched", tmp_path)
    assert decoded.unheard == (
        "no wire hears source/back",
        "anchor/away: too faint, left out (slots of 8 ms hear 2.75 m)",
    )
