"""The whole study on a small person: ranking, curve, constraints, files."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.estimate import ConstantsOptions
from mocap_jax.placement import (
    Constraints,
    ErrorModel,
    Judge,
    PlacementOptions,
    PlacementStudy,
    place,
    write_placement,
)
from mocap_jax.placement.search import crowding
from mocap_jax.placement.study import _resting
from mocap_jax.simulation import load_suit


@pytest.fixture(scope="module")
def study(person, motions, quick) -> PlacementStudy:
    return place(person, motions, quick)


def test_ranking_and_curve_fall(study: PlacementStudy):
    values = [p.value for p in study.placements]
    assert values == sorted(values)
    errors = [c.mean_cm for c in study.curve]
    assert [c.sensors for c in study.curve] == [1, 2, 3]
    assert errors == sorted(errors, reverse=True)
    assert study.certificate.exhaustive  # 10 choices of 2 among 5 segments, of 30 allowed


def test_moving_sensors_helps(study: PlacementStudy):
    """Places are at least as good as the middles of the patches that the choice was made at."""
    assert study.best.value <= study.certificate.value * (1 + 1e-12)


def test_expected_errors_are_those_of_the_written_suit(study: PlacementStudy, motions, quick):
    """Through the suit's positions instead of places on patches."""
    judged = Judge(study.body, motions, quick).evaluate(study.best.suit, 3)
    assert judged.value == pytest.approx(study.best.value, rel=1e-9)


def test_boards_face_away_from_the_skin(study: PlacementStudy):
    from mocap_jax.report.placement_picture import sensor_frames

    points, outward = sensor_frames(study.body, study.best)
    resting = _resting(study.body)
    for point, axis, board in zip(points, outward, study.best.suit.boards, strict=True):
        b = study.body.topology.body_index(board.segment)
        assert (point - resting.position[b]) @ axis > 0


def test_least_distance_is_kept(person, motions, quick):
    """Head and trunk, forced to be far apart for this person."""
    far = Constraints(allowed=("T8", "RightUpperArm"), distance_m=0.29)
    study = place(person, motions[:1], dataclasses.replace(quick, constraints=far, most=2))
    boards, resting = study.best.suit.boards, _resting(study.body)
    bodies = np.array([study.body.topology.body_index(b.segment) for b in boards])
    points = np.array([b.position for b in boards])
    assert float(crowding(points, bodies, resting, 0.29)) < 2e-3


def test_files_go_through_simulation(study: PlacementStudy, motions, tmp_path):
    write_placement(tmp_path, "placement1", study, study.best)
    suit = load_suit(tmp_path / "placement1.toml", study.body)
    assert suit == study.best.suit
    body = mj.load_body(tmp_path / "placement1.xml")
    recording = mj.simulate(motions[0], suit=suit, profile="paper")
    assert set(recording.inertial) == {b.name for b in study.best.suit.boards}
    for board in suit.boards:
        assert recording.inertial[board.name].accelerometer.shape[1] == 3
        np.testing.assert_allclose(
            np.asarray(body.site_pos)[body.site_index(board.name)], board.position
        )
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.slow
def test_recordings_of_a_placement_are_reconstructed(study: PlacementStudy, motions):
    recording = mj.simulate(motions[0], suit=study.best.suit, profile="paper")
    solution = mj.optimise(recording, options=mj.OptimiseOptions(kinds="AG", rate_hz=60.0))
    assert solution.status.ok
    assert mj.evaluate(solution, recording)["position_error_mean_cm"]["mean"] < 10


def test_picture_is_drawn(study: PlacementStudy, tmp_path):
    from mocap_jax.report import write_placement_picture

    write_placement_picture(tmp_path / "p.png", study)
    assert (tmp_path / "p.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(sensors=9), "sensors 9: more than the 6 segments"),
        (dict(joints=("Tail",)), "joints 'Tail'.*valid: T8"),
        (dict(constraints=Constraints(costs={"Tail": 2.0})), "'Tail'.*RightHand"),
        (dict(constraints=Constraints(required=("Tail",))), "'Tail'.*RightHand"),
    ],
)
def test_wrong_requests_name_the_valid_choices(person, motions, quick, changes, message):
    options = dataclasses.replace(quick, **{"most": None} | changes)
    with pytest.raises(InputError, match=message):
        place(person, motions[:1], options)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PlacementOptions(objective="B"), "objective 'B'.*A, D, E, worst"),
        (lambda: PlacementOptions(sensors=0), "sensors 0: must be 1 or more"),
        (lambda: PlacementOptions(root="none"), "root 'none'.*given, free"),
        (lambda: ErrorModel(kinds="D"), "sensor kind 'D'.*A, G, AG"),
        (
            lambda: ErrorModel(constants=ConstantsOptions(heading_sigma=0.1)),
            "heading_sigma; valid: 0",
        ),
    ],
)
def test_wrong_options_name_the_valid_choices(make, message):
    with pytest.raises(InputError, match=message):
        make()
