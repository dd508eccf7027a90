"""Anchors in the world: receivers and sources, in suits, set-up files and simulated recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.simulation import Anchor, Suit, load_suit, save_suit, simulate
from mocap_jax.simulation.profiles import profile_named

EAR = Anchor("ear", (1.5, 0.2, 1.4))
# Its axis looks down.
LAMP = Anchor("lamp", (0.2, 0.3, 2.6), (0.0, 1.0, 0.0, 0.0), emits=True)


@pytest.fixture(scope="module")
def anchored(suit: Suit) -> Suit:
    return replace(suit, anchors=(EAR, LAMP))


@pytest.fixture(scope="module")
def ideal(motion, anchored):
    return simulate(motion, profile="ideal", suit=anchored)


def test_anchors_hear_and_are_heard(ideal) -> None:
    ranges = ideal.ranges
    assert ranges.source_names == ideal.setup.sources
    assert ranges.source_names[-1] == "anchor/lamp" and ranges.receiver_names[-1] == "anchor/ear"
    model = load_body(ideal.truth.body_xml).mujoco_model()
    data, truth = mujoco.MjData(model), ideal.truth.trajectory
    for source, receiver in (("source/front", "anchor/ear"), ("anchor/lamp", "upper")):
        chosen = np.flatnonzero(
            (np.asarray(ranges.source) == ranges.source_names.index(source))
            & (np.asarray(ranges.receiver) == ranges.receiver_names.index(receiver))
            & (np.asarray(ranges.time) < ideal.setup.rest.end - 0.1)
        )
        assert len(chosen) > 10
        data.qpos[:] = np.asarray(truth.q)[0]
        mujoco.mj_kinematics(model, data)
        still = np.linalg.norm(data.site(source).xpos - data.site(receiver).xpos)
        np.testing.assert_allclose(np.asarray(ranges.distance)[chosen], still, atol=1e-6)


def test_boards_measure_the_same_with_and_without_anchors(ideal, motion, suit) -> None:
    without = simulate(motion, profile="ideal", suit=suit)
    for name, stream in without.inertial.items():
        np.testing.assert_array_equal(stream.accelerometer, ideal.inertial[name].accelerometer)


def test_a_body_in_the_way_hides_an_anchor(motion, suit) -> None:
    behind = replace(suit, anchors=(Anchor("behind", (-1.5, 0.0, 1.2)),))
    ranges = simulate(motion, profile="ideal", suit=behind).ranges
    heard = np.asarray(ranges.receiver) == ranges.receiver_names.index("anchor/behind")
    early = np.asarray(ranges.time) < 2.0
    sources = set(np.asarray(ranges.source)[heard & early])
    assert sources == {ranges.source_names.index("source/back")}


def test_thermometers_and_survey_err_as_stated(motion, suit) -> None:
    listening = replace(suit, anchors=(EAR, replace(EAR, name="far", position=(2.2, 0.4, 1.5))))
    profile = replace(profile_named("ideal"), anchor_temperature=2.0, anchor_position=0.01)
    wrong = simulate(motion, profile=profile, suit=listening, seed=3)
    only_moved = simulate(
        motion, profile=replace(profile, anchor_temperature=0.0), suit=listening, seed=3
    )
    parameters = wrong.truth.parameters
    for i, name in enumerate(wrong.ranges.receiver_names):
        at = np.asarray(wrong.ranges.receiver) == i
        ratio = np.asarray(wrong.ranges.distance)[at] / np.asarray(only_moved.ranges.distance)[at]
        error = float(parameters.get(f"anchor_temperature/{name}", 0.0))
        np.testing.assert_allclose(ratio, np.sqrt(1 + error / (343.0 / 20.05) ** 2), rtol=1e-9)
        assert (error != 0) == name.startswith("anchor/")
    shift = np.asarray(parameters["anchor_position/anchor/ear"])
    stated, true = load_body(wrong.body_xml), load_body(wrong.truth.body_xml)
    site = stated.site_index("anchor/ear")
    moved = np.asarray(true.site_pos)[site] - np.asarray(stated.site_pos)[site]
    np.testing.assert_allclose(moved, shift, atol=1e-12)
    assert 0.001 < np.abs(shift).max() < 0.05


def test_set_up_file_round_trip(anchored: Suit, tmp_path: Path) -> None:
    upright = replace(
        anchored,
        boards=anchored.boards[:1],
        sources=(replace(anchored.sources[0], frequency=33_000.0),),
        anchors=(EAR, replace(LAMP, frequency=25_500.0)),
    )
    assert upright.frequencies == (33_000.0, 25_500.0)
    save_suit(tmp_path / "suit.toml", upright)
    assert load_suit(tmp_path / "suit.toml") == upright


@pytest.mark.parametrize(
    ("lines", "fault"),
    [
        ('[[anchors]]\nname="x"\nposition=[0,0,0]\nsegment="base"\n',
         "unknown key 'segment'; valid: name, position"),
        ('[[anchors]]\nname="x"\nposition=[0,0,0]\nemits=1\n', "emits must be true or false"),
        ('[[anchors]]\nname="x"\nposition=[0,0,0]\nfrequency=0\n',
         "frequency must be a number above 0"),
        ("frequency=40000\n", "unknown key 'frequency'; valid: name, segment"),
    ],
)  # fmt: skip
def test_wrong_set_up_files(lines: str, fault: str, tmp_path: Path) -> None:
    file = tmp_path / "suit.toml"
    file.write_text(f'[[boards]]\nname="a"\nsegment="base"\nposition=[0,0,0]\n{lines}')
    with pytest.raises(InputError, match=fault):
        load_suit(file)


def test_wrong_anchors(suit: Suit, motion) -> None:
    with pytest.raises(InputError, match="'anchor/ear' exists already"):
        simulate(motion, suit=replace(suit, anchors=(EAR, EAR)))
    with pytest.raises(InputError, match="no boards"):
        simulate(motion, suit=Suit((), suit.sources))
