"""Sensors apart: greatest distances of patches by sampling, places that keep a least one."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.placement import Constraints, place
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


def test_no_two_places_are_farther_apart_than_the_greatest_distance(surfaces, resting):
    far = farthest(surfaces.patches, resting)
    rng = np.random.default_rng(0)
    found = np.zeros((3, 3))
    for _ in range(300):
        points = np.asarray(surfaces.points(surfaces.places(3 * rng.normal(size=(3, 2)))))
        bodies = np.array([p.body for p in surfaces.patches])
        world = np.asarray(resting.world(bodies, jnp.asarray(points)))
        found = np.maximum(found, np.linalg.norm(world[:, None] - world[None], axis=-1))
    pairs = np.triu_indices(3, 1)
    assert (found[pairs] <= far[pairs] + 0.005).all()
    assert (found[pairs] >= 0.9 * far[pairs]).all()
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
