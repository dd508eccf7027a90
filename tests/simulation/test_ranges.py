"""Ranges against geometry traced independently, and confidence that knows no truth."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

from mocap_jax.body import load_body
from mocap_jax.simulation import SimulationOptions, simulate
from mocap_jax.simulation.flight import Flights
from mocap_jax.simulation.hearing import (
    HearingFigures,
    continuity_confidence,
    hear,
    signal_confidence,
)
from mocap_jax.simulation.rest_hold import perform

FIGURES = HearingFigures()


@pytest.fixture(scope="module")
def ideal(motion, suit):
    return simulate(motion, profile="ideal", suit=suit)


def _position(model, data, spline, time, site):
    data.qpos[:] = spline.pose(np.array([time]))[0]
    mujoco.mj_kinematics(model, data)
    return data.site(site).xpos.copy()


def test_ideal_ranges_are_emission_to_arrival(motion, ideal):
    model = load_body(ideal.truth.body_xml).mujoco_model()
    data = mujoco.MjData(model)
    spline = perform(motion, SimulationOptions()).spline(motion.body.topology)
    ranges = ideal.ranges
    moving = np.flatnonzero(np.asarray(ranges.time) > ideal.setup.score_from)
    for i in moving[:: max(1, len(moving) // 40)]:
        t = float(ranges.time[i])
        source = ranges.source_names[ranges.source[i]]
        receiver = ranges.receiver_names[ranges.receiver[i]]
        origin = _position(model, data, spline, t, source)

        def late(tau, t=t, origin=origin, receiver=receiver):
            arrival = _position(model, data, spline, t + tau, receiver)
            return np.linalg.norm(arrival - origin) - 343.0 * tau

        flight = brentq(late, 0.0, 0.01, xtol=1e-14)
        assert ranges.distance[i] == pytest.approx(343.0 * flight, abs=1e-7)


def test_pulses_go_round_and_confidence_is_full(ideal):
    ranges = ideal.ranges
    pulse = np.round(np.asarray(ranges.time) / 0.008).astype(int)
    np.testing.assert_allclose(ranges.time, 0.008 * pulse, atol=1e-12)
    np.testing.assert_array_equal(ranges.source, pulse % 2)
    assert set(np.asarray(ranges.confidence)) == {1.0}
    assert (np.diff(ranges.time) >= 0).all()


def test_only_visible_pairs_are_heard_ideally(ideal):
    """The board on the base's side lies on the edge of no cone; the back source hears no arm."""
    pairs = set(zip(ideal.ranges.source, ideal.ranges.receiver, strict=True))
    names = ideal.ranges.receiver_names
    assert (0, names.index("lower")) in pairs
    still = np.asarray(ideal.ranges.time) < 2.0
    behind = (np.asarray(ideal.ranges.source) == 1) & still
    assert not (np.asarray(ideal.ranges.receiver)[behind] == names.index("lower")).any()


def test_paper_ranges_have_the_stated_noise(motion, suit, ideal):
    paper = simulate(motion, profile="paper", suit=suit)
    exact = {
        key: d
        for *key_parts, d in zip(
            ideal.ranges.time, ideal.ranges.source, ideal.ranges.receiver, ideal.ranges.distance,
            strict=True,
        )
        for key in [tuple(key_parts)]
    }  # fmt: skip
    ranges = paper.ranges
    errors = np.array(
        [
            d - exact[key]
            for t, s, r, d, w in zip(
                ranges.time, ranges.source, ranges.receiver, ranges.distance, ranges.confidence,
                strict=True,
            )
            if w == 1.0 and (key := (t, s, r)) in exact
        ]
    )  # fmt: skip
    assert len(errors) > 100
    inliers = errors[np.abs(errors) < 0.02]
    assert len(inliers) > 0.98 * len(errors)
    assert inliers.std() == pytest.approx(0.0025, rel=0.15)


def _flights(distance, cosine, occluded, count=400):
    shape = (count, 1)
    return Flights(
        0.064 * np.arange(count), np.zeros(count, int), np.full(shape, distance),
        np.full(shape, cosine), np.full(shape, occluded),
    )  # fmt: skip


def test_hidden_pairs_end_with_low_confidence():
    rng = np.random.default_rng(0)
    seen = hear(_flights(1.0, 0.7, False), FIGURES, rng, max_range=2.75)
    assert np.median(seen.confidence) == 1.0
    for cosine, occluded in ((0.7, True), (-0.2, False)):
        hidden = hear(_flights(1.0, cosine, occluded), FIGURES, rng, max_range=2.75)
        assert np.median(hidden.confidence) < 0.05
        assert hidden.confidence.mean() < 0.1


def test_confidence_knows_neither_occlusion_nor_angle():
    """Where the sound that arrives is the same, what is true changes nothing."""
    clear = replace(FIGURES, leak=(1.0, 1.0), detour=0.0, beam=0.0)
    reports = [
        hear(_flights(1.2, cosine, hidden), clear, np.random.default_rng(5), max_range=2.75)
        for cosine, hidden in ((0.9, False), (0.1, False), (0.9, True))
    ]
    for other in reports[1:]:
        np.testing.assert_array_equal(reports[0].confidence, other.confidence)
        np.testing.assert_array_equal(reports[0].path, other.path)


def test_signal_confidence_is_bounded_and_monotone():
    amplitude = np.linspace(0.0, 2.0, 400)
    weight = signal_confidence(amplitude, np.ones(400), FIGURES)
    assert weight.min() == 0.0 and weight.max() == 1.0
    assert (np.diff(weight) >= -1e-12).all()
    assert (weight[amplitude <= FIGURES.gate * FIGURES.noise] == 0).all()
    above = amplitude**2 >= FIGURES.strength_threshold
    assert (weight[above] == 1).all()


def test_continuity_falls_with_jumps_and_forgets():
    time = 0.064 * np.arange(6)
    path = np.array([1.0, 1.05, 2.0, 1.0, 1.0, 1.0])[:, None]
    weight = continuity_confidence(time, np.zeros(6, int), path, np.ones((6, 1)), FIGURES)[:, 0]
    assert weight[0] == weight[1] == 1.0
    assert weight[2] == 0.0
    assert weight[4] == weight[5] == 1.0
    silent = np.array([1.0, 0, 0, 0, 0, 0])[:, None]
    forgotten = continuity_confidence(time, np.zeros(6, int), path, silent, FIGURES)[:, 0]
    assert forgotten[5] == 1.0


def test_suit_without_sources_has_no_ranges(motion, suit):
    recording = simulate(motion, profile="ideal", suit=replace(suit, sources=()))
    assert recording.ranges is None
