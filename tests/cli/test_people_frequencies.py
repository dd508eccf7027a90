"""What frequencies several people's sources have where none are asked for."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mocap_jax.cli.people_frequencies import tuned
from mocap_jax.simulation import Anchor, Mounting, Suit

PLACE = (0.0, 0.0, 0.0)


def suit(*frequencies: float) -> Suit:
    devices = tuple(Mounting(f"s{i}", "T8", PLACE, frequency=f) for i, f in enumerate(frequencies))
    return Suit((Mounting("board", "T8", PLACE),), devices)


@pytest.mark.parametrize(
    ("worn", "lamps", "count", "expected"),
    [
        ((40e3, 40e3), (), 3, [{40e3}, {33e3}, {47e3}]),
        ((33e3,), (), 3, [{33e3}, {40e3}, {47e3}]),
        ((40e3,), (33e3,), 2, [{40e3}, {47e3}]),
        ((40e3, 33e3), (), 2, [{40e3, 33e3}, {47e3}]),
        ((36e3,), (), 2, [{36e3}, {47e3}]),  # 4 kHz from 40, 3 kHz from 33
        ((42e3,), (), 3, [{42e3}, {33e3}, {47e3}]),
    ],
)
def test_what_is_apart_from_all_before(capsys, worn, lamps, count, expected):
    anchors = tuple(
        Anchor(f"l{i}", PLACE, emits=True, frequency=f) for i, f in enumerate(lamps)
    )  # fmt: skip
    people = dict.fromkeys("abc"[:count], suit(*worn))
    out = tuned(people, anchors, None)
    assert [{s.frequency for s in person.sources} for person in out.values()] == expected
    assert capsys.readouterr().err == ""


def test_where_none_is_left_the_rarest_is_shared_and_told(capsys):
    lamp = Anchor("lamp", PLACE, emits=True, frequency=47e3)
    out = tuned(dict.fromkeys("abc", suit(40e3, 40e3)), (lamp,), None)
    assert [s.sources[0].frequency for s in out.values()] == [40e3, 33e3, 47e3]
    told = capsys.readouterr().err
    assert "is left for c" in told and "a 40000, b 33000, c 47000, anchors 47000" in told
    near = tuned(dict.fromkeys("ab", suit(36e3)), (replace(lamp, frequency=44e3),), None)
    assert near["b"].sources[0].frequency in (33e3, 40e3, 47e3)
    assert "anchors 44000" in capsys.readouterr().err


def test_listening_anchors_and_suits_without_sources_take_no_frequency(capsys):
    ear = Anchor("ear", PLACE, frequency=33e3)
    out = tuned(dict.fromkeys("ab", suit(40e3)), (ear,), None)
    assert out["b"].sources[0].frequency == 33e3
    bare = dict.fromkeys("abc", suit())
    assert tuned(bare, (), None) == bare
    assert capsys.readouterr().err == ""


def test_what_is_asked_for_is_everybodys(capsys):
    out = tuned(dict.fromkeys("ab", suit(40e3)), (), (41e3, 42e3))
    assert [s.sources[0].frequency for s in out.values()] == [41e3, 42e3]
    assert capsys.readouterr().err == ""
