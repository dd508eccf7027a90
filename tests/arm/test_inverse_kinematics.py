"""Denavit-Hartenberg forward and inverse against each other and against plain geometry."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.arm import forward, planar_angles, spatial_arm
from mocap_jax.errors import InputError

LENGTHS = (0.30, 0.25)


def _wrist(angles: np.ndarray) -> np.ndarray:
    """Geometry written out (eq. 6)."""
    l1, l2 = LENGTHS
    both = angles.sum(axis=1)
    return np.stack([
        l1 * np.cos(angles[:, 0]) + l2 * np.cos(both), l1 * np.sin(angles[:, 0]) + l2 * np.sin(both)
    ], axis=1)  # fmt: skip


def test_an_elbow_that_bends_one_way_stays_on_its_side() -> None:
    """Out of full extension the nearer branch is a matter of noise."""
    angle, shoulder = np.deg2rad([5.0, 0.1, 8.0]), np.deg2rad([-80.0, -79.9, -88.0])
    wrist = np.stack([
        0.3 * np.cos(shoulder) + 0.25 * np.cos(shoulder + angle),
        0.3 * np.sin(shoulder) + 0.25 * np.sin(shoulder + angle),
    ], axis=1)  # fmt: skip
    found = planar_angles(wrist, (0.3, 0.25), one_way=True)
    np.testing.assert_allclose(found.elbow, angle, atol=1e-6)
    np.testing.assert_allclose(found.shoulder, shoulder, atol=1e-6)
    # The mirror image is nearer here.
    assert planar_angles(wrist, (0.3, 0.25)).elbow[-1] < 0


def test_forward_is_plain_geometry() -> None:
    angles = np.array([-1.2, 0.7])
    T = np.asarray(forward(angles, LENGTHS))
    np.testing.assert_allclose(T[:2, 3], _wrist(angles[None])[0], atol=1e-14)
    c, s = np.cos(angles.sum()), np.sin(angles.sum())
    np.testing.assert_allclose(T[:3, :3], [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_inverse_undoes_forward_through_whole_turns(sign: float) -> None:
    t = np.linspace(0, 1, 400)
    angles = np.stack([9 * t - 1.0, sign * (1.2 + 0.9 * np.sin(7 * t))], axis=1)
    found = planar_angles(_wrist(angles), LENGTHS, branch=sign)
    np.testing.assert_allclose(found.shoulder, angles[:, 0], atol=1e-9)
    np.testing.assert_allclose(found.elbow, angles[:, 1], atol=1e-9)
    assert not found.clamped.any()


def test_out_of_reach_is_clamped_and_said_and_the_branch_outlives_it() -> None:
    angles = np.stack([np.full(5, -1.0), [0.3, 0.1, 0.0, 0.1, 0.3]], axis=1)
    wrist = _wrist(angles)
    wrist[2] *= 1.01
    found = planar_angles(wrist, LENGTHS)
    np.testing.assert_array_equal(found.clamped, [False, False, True, False, False])
    assert found.elbow[2] == 0
    np.testing.assert_allclose(found.elbow, angles[:, 1], atol=1e-7)
    np.testing.assert_allclose(found.shoulder, angles[:, 0], atol=1e-7)


def test_in_space_the_elbow_is_found_and_the_swivel_is_not() -> None:
    rng = np.random.default_rng(0)
    upper = rng.normal(size=(50, 3))
    upper *= LENGTHS[0] / np.linalg.norm(upper, axis=1, keepdims=True)
    fore = rng.normal(size=(50, 3))
    fore *= LENGTHS[1] / np.linalg.norm(fore, axis=1, keepdims=True)
    wrist = upper + fore
    found = spatial_arm(wrist, LENGTHS)
    bend = np.arccos((upper * fore).sum(1) / (LENGTHS[0] * LENGTHS[1]))
    np.testing.assert_allclose(found.elbow, bend, atol=1e-9)
    # The true elbow is somewhere on the stated circle, as any swivel's elbow is.
    away = upper - found.elbow_centre
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), found.elbow_radius, atol=1e-9)
    np.testing.assert_allclose((away * found.direction).sum(1), 0.0, atol=1e-9)
    for swivel in (0.0, 1.0, 3.0):
        elbow = spatial_arm(wrist, LENGTHS, swivel=swivel).elbow_position
        np.testing.assert_allclose(np.linalg.norm(elbow, axis=1), LENGTHS[0], atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(wrist - elbow, axis=1), LENGTHS[1], atol=1e-9)
    assert "swivel" in found.undetermined


def test_lengths_must_be_positive() -> None:
    with pytest.raises(InputError, match="both must be above 0 m"):
        planar_angles(np.zeros((2, 2)), (0.3, 0.0))
