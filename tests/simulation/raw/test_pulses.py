"""Pulses are gathered one by one; what was handed out stays."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.decoding.pulses import Pulses
from mocap_jax.errors import InputError


def test_pulses_grow_keep_their_order_and_count_what_is_missing():
    pulses, early = Pulses(), np.zeros(0)
    for i in range(5000):
        if i not in (7, 8, 3000):
            pulses.add(0.008 * i, "ab"[i % 2])
        if i == 1000:
            early = pulses.time
    assert len(early) == 999 and len(pulses.time) == 4997
    np.testing.assert_array_equal(early, pulses.time[:999])
    assert pulses.missing(0.008) == 3
    source, names = pulses.sources(("b", "c"))
    assert names == ("b", "c", "a")
    np.testing.assert_array_equal(source[:4], [2, 0, 2, 0])
    with pytest.raises(InputError, match="/pulse: 1.000000 s comes behind 39.992000 s"):
        pulses.add(1.0, "a")


def test_no_pulses():
    source, names = Pulses().sources(())
    assert source.shape == (0,) and names == () and Pulses().missing(0.008) == 0


def test_pulses_of_different_frequencies_may_sound_at_the_same_time():
    pulses = Pulses({"high": 1})
    for i in range(10):
        if i != 4:
            pulses.add(0.008 * i, "low")
        if i not in (6, 7):
            pulses.add(0.008 * i, "high")
    assert pulses.missing(0.008) == 3
    np.testing.assert_array_equal(pulses.emissions.band[:4], [0, 1, 0, 1])
    with pytest.raises(InputError, match="0.072000 s comes behind 0.072000 s"):
        pulses.add(0.072, "low")
    with pytest.raises(InputError, match="0.064000 s comes behind 0.072000 s"):
        pulses.add(0.064, "high")
    assert len(pulses.emissions.until(0.0).time) == 2
    assert len(pulses.emissions.until(0.008, inclusive=False).time) == 2
