"""Sensors apart: greatest distances of patches by sampling, places that keep a least one."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.placement import Constraints, DistanceError, place
from mocap_jax.placement.spacing import Resting, closest, crowding, farthest, kept_apart
from mocap_jax.placement.study import _resting
from mocap_jax.placement.surface import Surfaces, patches_of

NAMES = ("T8", "RightUpperArm", "RightForeArm")


@pytest.fixture(scope="module")
def resting(person) -> Resting:
    return _resting(person)


@pytest.fixture(scope="module")
def surfaces(person) -> Surfaces:
    return Surfaces(patches_of(person, NAMES))


def gap(surfaces: Surfaces, resting: Resting, free: np.ndarray) -> float:
    """Least distance, by a loop."""
    points = np.asarray(surfaces.points(surfaces.places(jnp.asarray(free))))
    world = [
        resting.position[p.body] + resting.rotation[p.body] @ x
        for p, x in zip(surfaces.patches, points, strict=True)
    ]
    pairs = [(i, j) for i in range(len(world)) for j in range(i)]
    return min(float(np.linalg.norm(world[i] - world[j])) for i, j in pairs)


def reached(surfaces: Surfaces, resting: Resting) -> np.ndarray:
    """Greatest distances of pairs among many places, those of the corners included."""
    rng = np.random.default_rng(0)
    free = rng.choice([-4.0, -2.0, 0.0, 2.0, 4.0], (1500, 3, 2))
    free[::2] = 3 * rng.normal(size=(750, 3, 2)).clip(-4 / 3, 4 / 3)
    points = np.asarray(jax.vmap(lambda x: surfaces.points(surfaces.places(x)))(free))
    world = np.stack(
        [resting.position[p.body] + points[:, i] @ resting.rotation[p.body].T
         for i, p in enumerate(surfaces.patches)], axis=1,
    )  # fmt: skip
    return np.linalg.norm(world[:, :, None] - world[:, None], axis=-1).max(0)


def test_no_two_places_exceed_the_distance_that_excludes_pairs(surfaces, resting):
    """It is above what is reached, by no more than steps of the grid: a few centimetres."""
    far, found = farthest(surfaces.patches, resting), reached(surfaces, resting)
    pairs = np.triu_indices(3, 1)
    assert (found[pairs] <= far[pairs]).all()
    assert (found[pairs] >= far[pairs] - 0.04).all()
    np.testing.assert_allclose(far, far.T, atol=1e-12)


def test_the_least_distance_is_that_of_the_nearest_pair(surfaces, resting):
    free = np.random.default_rng(1).normal(size=(3, 2))
    bodies = np.array([p.body for p in surfaces.patches])
    points = surfaces.points(surfaces.places(jnp.asarray(free)))
    least = gap(surfaces, resting, free)
    assert closest(points, bodies, resting) == pytest.approx(least, rel=1e-6)
    assert float(crowding(points, bodies, resting, 0.99 * least)) == 0.0
    assert float(crowding(points, bodies, resting, 1.5 * least)) > 0.0
    assert closest(points[:1], bodies[:1], resting) == np.inf


def test_places_part_no_more_than_they_must(surfaces, resting):
    free = np.zeros((3, 2))
    least = gap(surfaces, resting, free)
    np.testing.assert_array_equal(kept_apart(surfaces, resting, free, 0.9 * least), free)
    parted = kept_apart(surfaces, resting, free, 1.2 * least)
    assert 1.2 * least <= gap(surfaces, resting, parted) < 1.3 * least
    never = kept_apart(surfaces, resting, free, 5.0)
    assert np.isfinite(never).all() and gap(surfaces, resting, never) > least


def test_sensors_at_one_point_part(surfaces, resting):
    """Where the slope of their distance is zero."""
    twice = Surfaces((surfaces.patches[0],) * 2)
    parted = kept_apart(twice, resting, np.zeros((2, 2)), 0.04)
    assert 0.04 <= gap(twice, resting, parted) < 0.05
    np.testing.assert_array_equal(kept_apart(twice, resting, np.zeros((2, 2)), 0.0), 0.0)


def test_choices_that_cannot_keep_their_distance_make_way(person, motions, quick, resting):
    """Only chest and forearm can: the best choice for the elbow, and all triples, cannot."""
    patches = patches_of(person, NAMES)
    far = reached(Surfaces(patches), resting)
    distance = max(far[0, 1], far[1, 2]) + 0.005
    assert distance < farthest(patches, resting)[[0, 1], [1, 2]].min()  # no pair is excluded
    options = dataclasses.replace(
        quick, constraints=Constraints(allowed=NAMES, distance_m=distance),
        joints=("RightForeArm",), search=dataclasses.replace(quick.search, ranked=1, steps=1),
    )  # fmt: skip
    study = place(person, motions[:1], options)
    assert [p.segments for p in study.placements] == [("T8", "RightForeArm")]
    chosen = Surfaces(patches_of(person, study.best.segments))
    assert gap(chosen, resting, chosen.free(study.best.places)) >= distance - 1e-6
    assert study.certificate.dropped >= 1
    assert f"but {study.certificate.dropped} better, left out" in study.certificate.sentence
    assert [(c.sensors, c.segments) for c in study.curve][1:] == [(2, ("T8", "RightForeArm"))]
    with pytest.raises(DistanceError, match=f"^distance_m {distance:g}: no choice of 3 segments"):
        place(person, motions[:1], dataclasses.replace(options, sensors=3))


def test_all_placements_of_a_study_keep_their_distance(person, motions, quick, resting):
    """Two of three segments: of neighbours at the middles of their patches all are too near."""
    surfaces = Surfaces(patches_of(person, NAMES))
    middles = [
        gap(Surfaces((surfaces.patches[i], surfaces.patches[j])), resting, np.zeros((2, 2)))
        for i, j in ((0, 1), (1, 2))
    ]
    distance = 1.05 * max(middles)
    options = dataclasses.replace(
        quick, constraints=Constraints(allowed=NAMES, distance_m=distance), most=2,
        search=dataclasses.replace(quick.search, ranked=3, steps=2),
    )  # fmt: skip
    study = place(person, motions[:1], options)
    assert len(study.placements) == 3
    for placement in study.placements:
        chosen = Surfaces(patches_of(person, placement.segments))
        free = chosen.free(placement.places)
        assert gap(chosen, resting, free) >= distance - 1e-4, placement.segments


def test_segments_that_are_too_near_each_other_are_not_chosen(person, motions, quick, resting):
    far = farthest(patches_of(person, NAMES), resting)
    between = 0.5 * (min(far[0, 1], far[1, 2]) + far[0, 2])
    assert max(far[0, 1], far[1, 2]) < far[0, 2]
    options = dataclasses.replace(
        quick, constraints=Constraints(allowed=NAMES, distance_m=between), most=2,
        search=dataclasses.replace(quick.search, steps=1, restarts=1),
    )  # fmt: skip
    possible = far[np.triu_indices(3, 1)] >= between
    study = place(person, motions[:1], options)
    assert study.certificate.evaluated == possible.sum() < 3
    impossible = dataclasses.replace(
        options, constraints=Constraints(allowed=NAMES, distance_m=0.999)
    )
    with pytest.raises(InputError, match="no 2 sensors respect the constraints"):
        place(person, motions[:1], impossible)
