"""Sources: rows of distances against JAX through the kinematics; shared pulses; the choice."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax import so3
from mocap_jax.body import retract, site_frames
from mocap_jax.errors import InputError
from mocap_jax.placement import choose_sources
from mocap_jax.placement.scene import scenes_of
from mocap_jax.placement.sources import SourceStudy, _one_source
from mocap_jax.simulation import Mounting, Suit, mount

FORWARD = (0.7071067811865476, 0.0, 0.7071067811865476, 0.0)
BACKWARD = (0.7071067811865476, 0.0, -0.7071067811865476, 0.0)
SUIT = Suit(
    (
        Mounting("trunk", "T8", (0.11, 0.0, 0.1)),
        Mounting("arm", "RightForeArm", (0.04, 0.0, -0.12), FORWARD),
    ),
    (
        Mounting("belly", "Pelvis", (0.11, 0.0, 0.02), FORWARD),
        Mounting("back", "Pelvis", (-0.11, 0.0, 0.02), BACKWARD),
        Mounting("chest", "T8", (0.12, -0.05, 0.1), FORWARD),
    ),
)  # fmt: skip


@pytest.fixture(scope="module")
def study(person, motions, quick) -> SourceStudy:
    return choose_sources(person, motions[:1], SUIT, 1, quick)


def test_rows_are_the_derivatives_of_distances(person, motions, quick):
    worn = mount(person, SUIT)
    scene = scenes_of(worn, motions[:1], quick)[0]
    information = np.random.default_rng(0).uniform(0.5, 2, (scene.frames, 2))
    found = _one_source(scene, worn, SUIT, 0, information)
    source = worn.site_index("source/belly")
    boards = [worn.site_index(b.name) for b in SUIT.boards]

    # Offsets are in the segment's frame here; priors on them are the same in all directions.
    to_site = jnp.swapaxes(so3.quat_to_matrix(worn.site_quat), -1, -2)

    def distances(delta, offset, place, q):
        f = site_frames(worn, retract(worn.topology, q, delta))
        moved = lambda b, d: f.position[b] + f.rotation[b] @ to_site[b] @ d  # noqa: E731
        at = jnp.stack([moved(b, offset[i]) for i, b in enumerate(boards)])
        return jnp.linalg.norm(at - moved(source, place), axis=1)

    frame = scene.frames // 2
    at = (jnp.zeros(worn.nv), jnp.zeros((2, 3)), jnp.zeros(3), jnp.asarray(scene.poses[frame]))
    by_pose, by_offset, by_place = jax.jit(jax.jacfwd(distances, (0, 1, 2)))(*at)
    weight = np.diag(information[frame])
    np.testing.assert_allclose(found[0][frame], by_pose.T @ weight @ by_pose, atol=1e-9)
    columns = np.zeros((2, 24))
    for i in range(2):
        columns[:, 12 * i + 9 : 12 * i + 12] = by_offset[:, i]
    np.testing.assert_allclose(found[1][frame], by_pose.T @ weight @ columns, atol=1e-9)
    own = np.column_stack([by_place, np.ones(2)])
    np.testing.assert_allclose(found[2][frame], by_pose.T @ weight @ own, atol=1e-9)


def test_the_source_that_hears_the_arm_is_kept(study: SourceStudy):
    """All three were tried; one behind the back hears no board in front."""
    assert study.certificate.exhaustive and study.certificate.evaluated == 3
    assert study.chosen != ("back",)
    assert [s.name for s in study.suit.sources] == list(study.chosen)
    assert study.suit.boards == SUIT.boards


def test_distances_help(study: SourceStudy):
    assert study.expected_cm < study.none_cm
    assert study.loss == pytest.approx(study.expected_cm / study.all_cm - 1)


def test_more_sources_than_there_are_is_refused(person, motions, quick):
    options = dataclasses.replace(quick)
    with pytest.raises(InputError, match="count 4: the suit has 3 sources"):
        choose_sources(person, motions[:1], SUIT, 4, options)
