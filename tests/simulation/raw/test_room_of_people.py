"""Anchors and two people before one driver box, from the wires to distances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mocap_jax.decoding import decode_raw
from mocap_jax.errors import InputError
from mocap_jax.io.raw_file import RawReader
from mocap_jax.motion import together
from mocap_jax.signals.ultrasonic.arrivals import DetectorOptions
from mocap_jax.simulation import Anchor, SimulationOptions, Suit, simulate, suits_together
from mocap_jax.simulation.flight import trace
from mocap_jax.simulation.profiles import profile_named
from mocap_jax.simulation.raw import RawOptions, RawSimulation, simulate_raw
from mocap_jax.simulation.raw.room import Room, room_around
from mocap_jax.simulation.stage import set_stage

OPTIONS = SimulationOptions(rest_s=0.3, blend_s=0.5)
ROOM = RawOptions(floor_m=0.0)
DOWN = (0.0, 1.0, 0.0, 0.0)
EAR = Anchor("ear", (1.2, 1.2, 1.4), (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0))
LAMPS = tuple(
    Anchor(name, (0.6, y, 2.5), DOWN, emits=True, frequency=47e3)
    for name, y in (("left", 0.9), ("right", -0.9))
)


def of_frequency(suit: Suit, frequency: float) -> Suit:
    return replace(suit, sources=tuple(replace(s, frequency=frequency) for s in suit.sources))


@pytest.fixture(scope="module")
def pair(motion):
    return together({"a": motion, "b": motion}, {"b": (1.6, 0.3, np.pi)})


@pytest.fixture(scope="module")
def raw(pair, suit) -> RawSimulation:
    both = suits_together({"a": suit, "b": of_frequency(suit, 33e3)}, (EAR, *LAMPS))
    return simulate_raw(pair, profile="paper", suit=both, seed=1, options=OPTIONS, raw=ROOM)


@pytest.fixture(scope="module")
def path(raw, tmp_path_factory):
    path = tmp_path_factory.mktemp("people") / "people.raw.mcap"
    raw.write(path)
    return path


def errors_of(raw: RawSimulation, ranges) -> tuple[np.ndarray, np.ndarray]:
    """Errors [m] of all distances, and whether each is trusted and its direct way free."""
    row = {(round(t * 1e6), s): i for i, (t, s) in enumerate(
        zip(raw.pulse_time, raw.pulse_source, strict=True))}  # fmt: skip
    keys = zip(np.rint(np.asarray(ranges.time) * 1e6), np.asarray(ranges.source), strict=True)
    pulse, receiver = np.array([row[k] for k in keys]), np.asarray(ranges.receiver)
    trusted = (np.asarray(ranges.confidence) > 0.5) & raw.visible[pulse, receiver]
    return np.asarray(ranges.distance) - raw.distance[pulse, receiver], trusted


def owner(name: str) -> str:
    return next((p for p in "ab" if f"{p}/" in name), "room")


def test_each_frequency_has_pulses_in_every_slot(raw):
    assert raw.recording.setup.sources == (
        "source/a/front", "source/a/back", "source/b/front", "source/b/back", "anchor/left",
        "anchor/right",
    )  # fmt: skip
    times, count = np.unique(np.rint(raw.pulse_time / 0.008), return_counts=True)
    assert (count == 3).all() and len(times) > 400
    assert raw.wires[-1] == "anchor/ear" and len(raw.wires) == 7 and len(raw.boards) == 6


@pytest.mark.parametrize("detector", ["matched", "inflection"])
def test_distances_of_all_pairs_are_found(raw, path, detector: str):
    """On one body, between two, and to and from what stands in the room."""
    decoded = decode_raw(path, DetectorOptions(detector=detector))
    assert decoded.remarks == () and decoded.missing_pulses == 0
    ranges = decoded.recording.ranges
    assert ranges.receiver_names == raw.wires
    assert ranges.source_names == raw.recording.setup.sources
    error, trusted = errors_of(raw, ranges)
    source = np.array([owner(n) for n in ranges.source_names])[np.asarray(ranges.source)]
    receiver = np.array([owner(n) for n in ranges.receiver_names])[np.asarray(ranges.receiver)]
    for own, other in (("a", "a"), ("b", "b"), ("room", "a"), ("room", "b"), ("room", "room")):
        pairs = trusted & (source == own) & (receiver == other)
        assert pairs.sum() > 80, (own, other)
        assert np.median(np.abs(error[pairs])) < 0.004, (own, other)
        assert (np.abs(error[pairs]) > 0.015).mean() < 0.03, (own, other)
    between = trusted & (source != receiver) & (source != "room") & (receiver != "room")
    assert between.sum() > 80
    assert np.median(np.abs(error[between])) < 0.005


def test_three_frequencies_are_as_good_as_one(pair, suit, raw, path, tmp_path):
    """Leakage between bands costs little; every source is heard three times as often."""
    same = tuple(replace(lamp, frequency=40e3) for lamp in LAMPS)
    both = suits_together({"a": suit, "b": suit}, (EAR, *same))
    alone = simulate_raw(pair, profile="paper", suit=both, seed=1, options=OPTIONS, raw=ROOM)
    alone.write(tmp_path / "alone.raw.mcap")
    ranges = decode_raw(tmp_path / "alone.raw.mcap").recording.ranges
    many = decode_raw(path).recording.ranges
    (one, trusted), (three, heard) = errors_of(alone, ranges), errors_of(raw, many)
    assert heard.sum() > 2.5 * trusted.sum()
    spread = [np.sqrt(np.mean(np.clip(e, -0.02, 0.02) ** 2)) for e in (one[trusted], three[heard])]
    assert spread[1] < 1.3 * spread[0]


def test_wires_of_anchors_carry_no_telemetry(raw, path):
    decoded = decode_raw(path)
    recording = decoded.recording
    boards = tuple(b.name for b in recording.setup.sensors)
    assert tuple(recording.inertial) == tuple(decoded.boards) == boards == raw.wires[:-1]
    assert all(b.frames > 500 and b.lost == 0 for b in decoded.boards.values())
    assert np.asarray(recording.ranges.receiver).max() == len(boards)


def test_the_file_tells_the_frequencies(path):
    reader = RawReader(path)
    next(iter(reader.messages()))
    assert reader.driver_box().source_frequency_hz == {
        "source/b/front": 33e3, "source/b/back": 33e3, "anchor/left": 47e3, "anchor/right": 47e3
    }  # fmt: skip


def test_one_person_and_the_ceiling_hear_what_the_direct_simulation_says(motion, suit, tmp_path):
    """Without noise and echoes, anchors that listen and sound included."""
    anchored = replace(suit, anchors=(EAR, *LAMPS))
    raw = simulate_raw(motion, profile="ideal", suit=anchored, options=OPTIONS)
    raw.write(tmp_path / "ideal.raw.mcap")
    direct = simulate(motion, profile="ideal", suit=anchored, options=OPTIONS).ranges
    found = decode_raw(tmp_path / "ideal.raw.mcap").recording.ranges
    assert found.receiver_names == direct.receiver_names
    assert found.source_names == direct.source_names

    def table(r) -> dict:
        columns = (np.rint(np.asarray(r.time) / 0.008), r.source, r.receiver, r.distance)
        rows = zip(*(np.asarray(c).tolist() for c in columns), strict=True)
        return {(t, s, m): d for t, s, m, d in rows}

    true, own = table(direct), table(found)
    common = [k for k in own if k in true]
    for source in range(4):
        assert sum(k[1] == source for k in common) > 20
    assert sum(k[2] == 3 for k in common) > 50  # the ear
    error = np.array([own[k] - true[k] for k in common])
    assert np.sqrt(np.mean(error**2)) < 0.001 and np.abs(error).max() < 0.015


def test_a_source_and_listening_anchors_need_no_board(motion, suit, tmp_path):
    """As in the tracker of an arm: one mobile that sounds, anchors that listen."""
    alone = Suit((), suit.sources[:1], anchors=(EAR, replace(EAR, name="far", position=(2, 0, 1))))
    raw = simulate_raw(motion, profile="paper", suit=alone, options=OPTIONS, raw=ROOM)
    raw.write(tmp_path / "mobile.raw.mcap")
    recording = decode_raw(tmp_path / "mobile.raw.mcap").recording
    assert recording.inertial == {} and recording.setup.sensors == ()
    assert recording.ranges.receiver_names == ("anchor/ear", "anchor/far")
    error, trusted = errors_of(raw, recording.ranges)
    assert trusted.sum() > 200 and np.median(np.abs(error[trusted])) < 0.004


def test_anchors_need_nobody(motion):
    """Survey of a room: what stands in it, sounding and listening, while a body without devices
    moves."""
    alone = Suit((), anchors=(EAR, LAMPS[0]))
    raw = simulate_raw(motion, profile="paper", suit=alone, options=OPTIONS)
    assert raw.wires == ("anchor/ear",) and raw.recording.setup.sources == ("anchor/left",)
    assert np.abs(next(raw.chunks())[1]).max() > 100


def test_the_room_holds_everything(motion, suit):
    """A lamp above the usual ceiling raises it; an ear low down lowers the floor."""

    def room(*anchors: Anchor, **options) -> Room:
        worn = replace(suit, anchors=anchors)
        stage = set_stage(motion, profile_named("ideal"), 0, worn, OPTIONS)
        flights, emissions = trace(
            stage.rig, stage.spline, end=0.3, pulse_interval=0.008, speed_of_sound=343.0
        )
        found = RawOptions(**options)
        return room_around(stage.rig, stage.spline, flights.source, emissions, found)

    usual = room()
    assert usual.floor > 0.8 and usual.others[0] == (2, usual.floor + 2.6)
    assert room(floor_m=0.0).floor == 0.0
    high = room(Anchor("lamp", (3.0, 0, 4.0), DOWN, emits=True), floor_m=0.0)
    assert high.floor == 0.0 and high.others[0] == (2, 4.02)
    low = room(Anchor("ear", (1.0, 0, -1.0)))
    assert low.floor == pytest.approx(-1.02) and low.others[0][1] == pytest.approx(1.58)
    walls = [place for axis, place in high.others if axis == 0]
    assert walls[1] == pytest.approx(4.5), "1.5 m beyond the lamp"
    with pytest.raises(InputError, match=r"floor_m 2: above what is worn, which comes down to"):
        room(floor_m=2.0)


@pytest.mark.parametrize(
    ("figure", "fault"),
    [
        ({"chunk_s": 1e-7}, "chunk_s 1e-07: valid are 0.001 to 60"),
        ({"chunk_s": np.inf}, "chunk_s inf: valid are 0.001 to 60"),
        ({"chunk_s": np.nan}, "chunk_s nan: valid are"),
        ({"floor_m": np.nan}, "floor_m nan: valid are heights"),
        ({"floor_m": -np.inf}, "floor_m -inf: valid are heights"),
        ({"reference": np.inf}, "reference inf: valid are numbers above 0"),
        ({"telemetry": 0.0}, "telemetry 0: valid are numbers above 0"),
        ({"wall_distance_m": np.inf}, "wall_distance_m inf: valid are numbers above 0"),
        ({"ceiling_m": np.inf}, "ceiling_m inf: valid are numbers above 0"),
        ({"humidity": np.nan}, "humidity nan: valid are 0 to 100"),
    ],
)
def test_levels_and_rooms_that_are_none(figure, fault):
    with pytest.raises(InputError, match=fault):
        RawOptions(**figure)


def test_wrong_frequencies(motion, suit, path, tmp_path):
    with pytest.raises(InputError, match="source/front: bursts of 20000 Hz; the driver box's"):
        simulate_raw(motion, suit=of_frequency(suit, 20e3), options=OPTIONS)
    raw = simulate_raw(motion, profile="ideal", suit=suit, options=OPTIONS)
    first = [next(raw.chunks())]
    for wrong, words in ((60e3, "of 'source/front': 60000.0; valid: numbers from 25000 to 55000"),
                         ("high", "of 'source/front': high; valid")):  # fmt: skip
        file = tmp_path / "wrong.raw.mcap"
        replace(raw, _frequencies=(wrong, 40e3)).write(file, first)
        with pytest.raises(InputError, match=rf"wrong\.raw\.mcap: driver_box\.toml: .*{words}"):
            decode_raw(file)
    close = simulate_raw(motion, profile="ideal", options=OPTIONS, suit=replace(
        suit, sources=(suit.sources[0], replace(suit.sources[1], frequency=37e3))))  # fmt: skip
    close.write(tmp_path / "close.raw.mcap", first)
    (remark,) = decode_raw(tmp_path / "close.raw.mcap").remarks
    assert "sources of 37000 and 40000 Hz are less than 5000 Hz apart" in remark
