"""Quantities that placements are judged by: derivatives against finite differences of poses."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax import so3
from mocap_jax.body import frames, retract
from mocap_jax.errors import InputError
from mocap_jax.placement import Constraints, Judge, PlacementOptions, place
from mocap_jax.placement.targets import targets_of

ALLOWED = ("T8", "RightUpperArm", "RightForeArm")


@pytest.fixture(scope="module")
def scene(person, motions, quick):
    return Judge(person, motions[:1], quick).criterion.scenes[0]


def test_derivatives_are_those_of_relative_places_and_turns(person, scene):
    topology, scored = scene.body.topology, np.ones(scene.frames)
    names, targets = targets_of(scene.body, scene.kinematics, scored, ())
    assert names == tuple(n for n in topology.body_names if n not in ("world", "Pelvis"))
    at = scene.frames // 2
    q, step = jnp.asarray(scene.poses[at]), 1e-5

    def moved(d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f = frames(scene.body, retract(topology, q, jnp.asarray(d)))
        return np.asarray(f.rotation), np.asarray(f.position)

    R, _ = moved(np.zeros(topology.nv))
    for dof in range(topology.nv):
        ahead, behind = (moved(s * step * np.eye(topology.nv)[dof]) for s in (1, -1))
        for i, name in enumerate(names):
            b = topology.body_index(name)
            place = [p[b] - p[1] for _, p in (ahead, behind)]
            # The turn of a segment less that of the root segment, both as vectors in the world.
            turn = [
                np.asarray(
                    so3.log(jnp.asarray(x[b] @ R[b].T)) - so3.log(jnp.asarray(x[1] @ R[1].T))
                )
                for x, _ in (ahead, behind)
            ]
            for quantity, (a, z) in (("position", place), ("orientation", turn)):
                found = targets[quantity][i, at, :, dof] * np.sqrt(scene.frames)
                np.testing.assert_allclose(found, (a - z) / (2 * step), atol=1e-7)


def test_frames_share_the_mean_and_the_hold_does_not_count(scene):
    shares = (scene.targets["orientation"] ** 2).sum((0, 2, 3)) > 0
    assert shares.any() and not shares[0]
    same = scene.targets["position"] is scene.target
    assert same and dataclasses.replace(scene, quantity="orientation").target.shape[0] > 0


def test_orientations_are_judged_where_they_are_asked_for(person, motions, quick):
    options = dataclasses.replace(
        quick, quantity="orientation", most=2, constraints=Constraints(allowed=ALLOWED),
        search=dataclasses.replace(quick.search, steps=1, restarts=1),
    )  # fmt: skip
    study = place(person, motions[:1], options)
    assert study.unit == "deg"
    for placement in study.placements:
        deg = np.array(list(placement.expected("orientation").values()))
        assert np.sqrt((deg**2).mean()) == pytest.approx(np.rad2deg(np.sqrt(placement.value)))
    plain = Judge(person, motions[:1], dataclasses.replace(options, quantity="position"))
    found = plain.evaluate(study.best.suit, 2)
    assert study.best.mean_cm == pytest.approx(found.rms_cm, rel=1e-6)
    judged = Judge(person, motions[:1], options).evaluate(study.best.suit, 2)
    assert judged.rms_deg == pytest.approx(study.best.mean_deg, rel=1e-6)


def test_unknown_quantities_are_refused():
    with pytest.raises(InputError, match="quantity 'angle'.*position, orientation"):
        PlacementOptions(quantity="angle")
