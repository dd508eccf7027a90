"""Which joints share a rotation, and what unevenness is."""

from __future__ import annotations

import numpy as np

import mocap_jax as mj
from mocap_jax.pose_prior.rotations import segment_pairs
from mocap_jax.pose_prior.shares import sharing_joints, unevenness


def test_the_human_s_trunk_between_belly_and_chest_shares():
    body = mj.human()
    known = mj.default_pose_prior().of_segments(body.topology.body_names)
    pairs = [tuple(p) for p in segment_pairs(body, known.joints)]
    names = body.topology.body_names
    chains = sharing_joints(body.topology, pairs)
    assert [[(names[c], names[p]) for c, p in chain] for chain in chains] == [
        [("L3", "L5"), ("T12", "L3"), ("T8", "T12")]
    ]


def test_a_body_without_a_head_shares_nothing():
    body = mj.load_body(
        '<mujoco><worldbody><body name="Pelvis"><freejoint/><geom size=".1"/><body name="T8" '
        'pos="0 0 .3"><joint/><geom size=".1"/></body></body></worldbody></mujoco>'
    )
    assert sharing_joints(body.topology, [(2, 1)]) == ()


def test_equal_shares_are_even():
    matrix = unevenness(3, 0.1)
    even = np.tile([0.2, -0.1, 0.4], 3)
    np.testing.assert_allclose(matrix @ even, 0.0, atol=1e-12)
    folded = np.array([0.1, 0, 0, -0.1, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(np.linalg.norm(matrix @ folded), np.sqrt(2.0))
