"""`cut` keeps of every stream what lies in the stretch, and no more than that."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from cut_samples import recording

from mocap_jax.errors import InputError
from mocap_jax.recording import RestHold, cut


def test_every_stream_keeps_its_own_rows():
    whole, part = recording(), cut(recording(), 4.0, 6.0)
    streams = [
        (part.inertial["chest"], whole.inertial["chest"]),
        (part.magnetic["chest"], whole.magnetic["chest"]), (part.root, whole.root),
        (part.ranges, whole.ranges),
    ]  # fmt: skip
    for mine, other in streams:
        inside = [k for k, t in enumerate(other.time) if 4.0 <= t <= 6.0]
        assert len(inside) > 40
        for field in dataclasses.fields(other):
            values = getattr(other, field.name)
            if isinstance(values, np.ndarray):
                np.testing.assert_array_equal(getattr(mine, field.name), values[inside])
            else:
                assert getattr(mine, field.name) == values
    np.testing.assert_array_equal(part.temperature.time, [2.5, 5.0], "the last before counts")
    assert (part.start_utc_ns, part.subject, part.body_xml) == (12, "a", "<mujoco/>")
    assert part.setup.score_from == 3.0


def test_truth_covers_the_measurements_and_little_more():
    part = cut(recording(), 4.01, 6.01)
    np.testing.assert_allclose(part.truth.trajectory.time, np.arange(200, 302) * 0.02)
    np.testing.assert_array_equal(part.truth.trajectory.q[:, 0], part.truth.trajectory.time)
    np.testing.assert_array_equal(part.truth.parameters["bias"], np.arange(3.0))
    wobble = part.truth.parameters["wobble"]
    np.testing.assert_array_equal(wobble[:, 0], part.truth.trajectory.time)


def test_sensors_without_samples_are_left_out():
    part = cut(recording(), 4.0, 6.0)
    assert list(part.inertial) == ["chest"] == [s.name for s in part.setup.sensors]
    assert list(cut(recording(), 2.0, 6.0).inertial) == ["chest", "broken"]


@pytest.mark.parametrize(
    ("start", "stop", "kept"),
    [
        (0.0, 5.0, (0.0, 2.0)), (None, 5.0, (0.0, 2.0)), (1.0, 5.0, (1.0, 2.0)),
        (1.0, None, (1.0, 2.0)),
        (0.0, 1.25, (0.0, 1.25)), (1.6, 5.0, None), (4.0, 6.0, None),
    ],
)  # fmt: skip
def test_rest_hold_keeps_what_is_inside(start, stop, kept):
    rest = cut(recording(), start, stop).setup.rest
    assert (rest and (rest.start, rest.end)) == kept


def test_an_end_that_is_not_cut_leaves_the_hold():
    """Samples are stamped at the centres of their intervals: the first comes after zero."""
    whole = dataclasses.replace(recording(), ranges=None)
    assert whole.interval[0] > 0.0
    assert cut(whole, None, 5.0).setup.rest == RestHold(0.0, 2.0)


def test_a_short_hold_stays_if_whole():
    short = recording(RestHold(0.0, 0.3))
    assert cut(short, 0.0, 5.0).setup.rest == RestHold(0.0, 0.3)
    assert cut(short, 0.1, 5.0).setup.rest is None


def test_where_it_was_cut_stands_in_the_provenance_and_ends_stay():
    part = cut(recording(), 4.0)
    facts = part.setup.provenance
    assert facts == {"motion": "walk", "cut_start": 4.0, "cut_stop": pytest.approx(9.995)}
    assert part.interval[1] == recording().interval[1]
    again = cut(part, None, 5.0)
    assert again.interval == (4.0, 5.0), "pulses at both ends belong to the stretch"


@pytest.mark.parametrize(
    ("start", "stop", "words"),
    [
        (40, 50, "nothing between 40 s and 50 s: the recording has 0.00 s to 10.00 s"),
        (6, 4, "6 s to 4 s: the start must be before the end"), (4, 4, "must be before"),
        (np.nan, 4, "finite times"), (0, np.inf, "finite times"),
    ],
)  # fmt: skip
def test_impossible_stretches_are_refused(start, stop, words):
    with pytest.raises(InputError, match=words):
        cut(recording(), start, stop)


def test_a_gap_of_all_sensors_is_refused():
    late = dataclasses.replace(
        recording(), ranges=None, inertial={"broken": recording().inertial["broken"]}
    )
    with pytest.raises(InputError, match="no sensor measured anything"):
        cut(late, 4.0, 6.0)
