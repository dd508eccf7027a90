"""Sites on slides: the body is the same otherwise, and the site moves along its own axes."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from sample_bodies import MIXED

from mocap_jax.body import (
    floating_dofs,
    joint_dofs,
    load_body,
    normalise,
    site_frames,
    site_segments,
    with_floating_sites,
)


def _bodies():
    body = load_body(MIXED)
    chosen = list(range(body.topology.site_names.__len__()))[-2:]
    return body, chosen, with_floating_sites(body, chosen)


def _pose(body) -> np.ndarray:
    rng = np.random.default_rng(0)
    q = np.array(body.qpos0) + 0.3 * rng.normal(size=body.nq)
    return np.asarray(normalise(body.topology, jnp.asarray(q)))


def test_without_displacement_all_sites_stay():
    body, chosen, loose = _bodies()
    q = _pose(body)
    own, other = site_frames(body, q), site_frames(loose, np.append(q, np.zeros(3 * len(chosen))))
    np.testing.assert_allclose(own.position, other.position, atol=1e-14)
    np.testing.assert_allclose(own.rotation, other.rotation, atol=1e-14)


def test_a_displacement_is_along_the_site_s_axes():
    body, chosen, loose = _bodies()
    q, away = _pose(body), np.array([[0.01, -0.02, 0.005], [0.003, 0.0, 0.02]])
    own, other = site_frames(body, q), site_frames(loose, np.append(q, away.ravel()))
    for site, d in zip(chosen, away, strict=True):
        moved = np.asarray(own.position[site]) + np.asarray(own.rotation[site]) @ d
        np.testing.assert_allclose(other.position[site], moved, atol=1e-14)
    np.testing.assert_allclose(own.rotation, other.rotation, atol=1e-14)


def test_names_and_places():
    body, chosen, loose = _bodies()
    assert loose.nv == body.nv + 6 and loose.nq == body.nq + 6
    np.testing.assert_array_equal(floating_dofs(loose), body.nv + np.arange(6))
    assert len(floating_dofs(body)) == 0
    for either in (body, loose):
        np.testing.assert_array_equal(joint_dofs(either.topology), np.arange(6, body.nv))
    np.testing.assert_array_equal(site_segments(loose.topology), body.topology.site_body)
