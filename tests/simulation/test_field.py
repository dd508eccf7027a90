"""The field profile: every error is there, told only in the truth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.simulation import PROFILES, simulate


@pytest.fixture(scope="module")
def field(motion, suit):
    return simulate(motion, profile="field", suit=suit, seed=1)


def test_nominal_body_differs_from_the_true_one(field):
    nominal, actual = load_body(field.body_xml), load_body(field.truth.body_xml)
    assert nominal.topology == actual.topology
    ratio = np.linalg.norm(actual.body_pos[3]) / np.linalg.norm(nominal.body_pos[3])
    scale = float(field.truth.parameters["segment_scale/upper"])
    assert ratio == pytest.approx(scale, abs=1e-12)
    assert ratio != 1.0 and abs(ratio - 1) < 0.08


def test_mounting_errors_are_the_ones_told(field, suit):
    nominal, actual = load_body(field.body_xml), load_body(field.truth.body_xml)
    for board in suit.boards:
        i = nominal.site_index(board.name)
        turn = Rotation.from_quat(nominal.site_quat[i], scalar_first=True).inv() * (
            Rotation.from_quat(actual.site_quat[i], scalar_first=True)
        )
        told = np.asarray(field.truth.parameters[f"mounting_rotation/{board.name}"])
        np.testing.assert_allclose(turn.as_rotvec(), told, atol=1e-9)
        assert 0.1 < np.degrees(np.linalg.norm(told)) < 15
        scale = float(field.truth.parameters[f"segment_scale/{board.segment}"])
        moved = np.asarray(actual.site_pos[i]) - scale * np.asarray(nominal.site_pos[i])
        told = np.asarray(field.truth.parameters[f"mounting_position/{board.name}"])
        np.testing.assert_allclose(moved, told, atol=1e-12)


def test_paper_and_ideal_use_the_nominal_body(motion, suit):
    for profile in ("ideal", "paper"):
        recording = simulate(motion, profile=profile, suit=suit)
        assert recording.truth.body_xml == recording.body_xml


def test_rest_mean_shows_the_gyroscope_bias(field, suit):
    for board in suit.boards:
        stream = field.inertial[board.name]
        still = np.asarray(stream.time) < 1.9
        bias = np.asarray(field.truth.parameters[f"gyroscope_bias/{board.name}"])
        np.testing.assert_allclose(stream.gyroscope[still].mean(axis=0), bias, atol=1.5e-3)


def test_samples_are_lost_and_clocks_shifted(field, suit):
    total = len(field.truth.trajectory.time)
    lost = [1 - len(field.inertial[b.name].time) / total for b in suit.boards]
    assert 0.0 < np.mean(lost) < 0.05
    for board in suit.boards:
        offset = float(field.truth.parameters[f"clock_offset/{board.name}"])
        first = float(field.inertial[board.name].time[0])
        assert first - float(field.truth.trajectory.time[0]) == pytest.approx(offset, abs=1e-12)
        assert first >= 0 and abs(offset) <= 0.003


def test_declared_rest_pose_differs_from_the_held_one(field):
    names = load_body(field.body_xml).topology.joint_names
    declared = np.concatenate([field.setup.rest.pose[n] for n in names])
    held = np.asarray(field.truth.trajectory.q)[0]
    assert np.abs(held - declared)[7:].max() > 1e-3
    np.testing.assert_allclose(held[:7], declared[:7], atol=1e-9)
    error = np.asarray(field.truth.parameters["rest_pose_error"])
    assert (error[:6] == 0).all() and np.degrees(np.abs(error).max()) < 12


def test_boards_wobble_on_soft_tissue(motion, suit):
    """Against the same recording with fixed boards, acceleration changes but stays bounded."""
    from dataclasses import replace

    from mocap_jax.simulation.options import SimulationOptions
    from mocap_jax.simulation.rest_hold import perform
    from mocap_jax.simulation.rig import build_rig
    from mocap_jax.simulation.soft_tissue import wobble

    body = load_body(simulate(motion, profile="ideal", suit=suit).body_xml)
    boards = tuple(b.name for b in suit.boards)
    rig = build_rig(body, boards, suit.source_sites)
    performance = perform(motion, SimulationOptions())
    spline = performance.spline(rig.topology)
    profile = replace(PROFILES["field"], name="soft")
    pose = wobble(rig, spline, performance.time, boards, profile, 0)
    still = performance.time < 2.0
    assert np.abs(pose[still][:, :, :3]).max() < 1e-6
    shift = np.linalg.norm(pose[~still][:, :, :3], axis=2)
    assert 5e-4 < shift.max() < 0.02
    turn = np.degrees(Rotation.from_quat(pose[:, 2, 3:], scalar_first=True).magnitude())
    assert 0.1 < turn.max() < 6


def test_nothing_of_the_truth_is_declared(field):
    told = {f"{v}" for v in field.setup.provenance.values()}
    for name, value in field.truth.parameters.items():
        if np.ndim(value) == 0 and float(value) not in (0.0, 1.0):
            assert f"{float(value)}" not in told, name
    assert field.setup.speed_of_sound == 343.0
    assert float(field.truth.parameters["speed_of_sound"]) != 343.0


def test_multipath_makes_long_ranges_of_full_confidence(field, motion, suit):
    paper = simulate(motion, profile="paper", suit=suit, seed=1)
    strong = lambda r: np.asarray(r.ranges.confidence) == 1.0  # noqa: E731
    worst = np.asarray(field.ranges.distance)[strong(field)].max()
    usual = np.asarray(paper.ranges.distance)[strong(paper)].max()
    assert worst > usual + 0.2


def test_unknown_profile_and_seed_are_refused(motion, suit):
    with pytest.raises(InputError, match="ideal, paper, field"):
        simulate(motion, profile="xyz", suit=suit)
    with pytest.raises(InputError, match="seed"):
        simulate(motion, suit=suit, seed=-1)
