"""A set-up that names other boards than those that measured is told."""

from __future__ import annotations

from dataclasses import replace

from cut_samples import recording

from mocap_jax.recording import SensorSpec, unlisted_boards


def test_boards_of_the_set_up_are_not_told():
    whole = recording()
    assert not unlisted_boards(whole)
    assert not unlisted_boards(replace(whole, setup=replace(whole.setup, sensors=())))
    dropped = {"chest": whole.inertial["chest"]}
    assert not unlisted_boards(replace(whole, inertial=dropped))


def test_boards_that_the_set_up_does_not_name_are_told():
    whole = recording()
    other = replace(whole.setup, sensors=(SensorSpec("knee", "knee", 100.0),))
    (sentence,) = unlisted_boards(replace(whole, setup=other))
    assert "boards chest, broken" in sentence and "it names knee" in sentence
