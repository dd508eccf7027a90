"""Anchors that are left out, and those of which some distances are good."""

from __future__ import annotations

import numpy as np

from mocap_jax.decoding.pulses import Pulses
from mocap_jax.decoding.unheard import without_faint_anchors
from mocap_jax.recording import RangeStream

BOARDS = tuple(f"board{i}" for i in range(18))
LAMP, EAR = "anchor/lamp", "anchor/ear"


def left_out(confidence, sources: tuple[str, ...], receivers: tuple[str, ...]) -> tuple[str, ...]:
    """Names, where sources take turns; confidence of shape (pulses, receivers)."""
    confidence = np.asarray(confidence, float)
    pulses = Pulses()
    for i in range(len(confidence)):
        pulses.add(0.008 * i, sources[i % len(sources)])
    pulse, receiver = np.nonzero(confidence > 0)
    ranges = RangeStream(
        time=0.008 * pulse,
        source=pulse % len(sources),
        receiver=receiver,
        distance=np.ones(len(pulse)),
        confidence=confidence[pulse, receiver],
        source_names=sources,
        receiver_names=receivers,
    )
    rest, names = without_faint_anchors(ranges, pulses)
    kept = {rest.source_names[s] for s in np.asarray(rest.source)}
    kept |= {rest.receiver_names[r] for r in np.asarray(rest.receiver)}
    assert not kept & set(names), "their distances are gone"
    return names


def test_hidden_boards_do_not_outvote_those_that_hear():
    assert left_out([[0.5] * 4 + [0.03] * 14] * 100, (LAMP,), BOARDS) == ()


def test_a_time_nearby_is_enough():
    near, far = [[0.5] * 4 + [0.0] * 14] * 10, [[0.03] * 18] * 90
    assert left_out(near + far, (LAMP,), BOARDS) == ()


def test_what_comes_from_beyond_a_slot_is_left_out():
    """Many faint distances, some of 0.2 in a third of the pulses, and a good one in a hundred."""
    confidence = np.full((300, 18), 0.02)
    confidence[::3, :3] = 0.21
    confidence[::100, 0] = 0.6
    assert confidence.mean() < 0.15
    assert left_out(confidence, (LAMP,), BOARDS) == (LAMP,)


def test_faint_but_even_distances_are_kept():
    """As those of 3 to 4 m in long slots."""
    assert left_out([[0.25] * 18] * 100, (LAMP,), BOARDS) == ()


def test_one_source_that_faces_a_listening_anchor_is_enough():
    sources = tuple(f"source/{i}" for i in range(12))
    turn = [[0.5]] + [[0.03]] * 11
    assert left_out(turn * 20, sources, (EAR,)) == ()
    assert left_out([[0.03]] * 240, sources, (EAR,)) == (EAR,)


def test_silence_is_no_distance():
    assert left_out([[0.0] * 18] * 99 + [[0.2] + [0.0] * 17], (LAMP,), BOARDS) == (LAMP,)
