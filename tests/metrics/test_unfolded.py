"""Angles that are followed through full turns."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.metrics import unfolded_angles
from mocap_jax.metrics.rotation_angle import rotation_angle


def spin(angles: np.ndarray, axis: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(angles[:, None] * axis).as_matrix()


@pytest.mark.parametrize("seed", range(4))
def test_growing_angle_passes_a_half_turn_and_comes_back(seed: int):
    axis = np.random.default_rng(seed).normal(size=3)
    angles = np.concatenate([np.linspace(0.0, 6.2, 80), np.linspace(6.2, 0.1, 80)])
    found = unfolded_angles(spin(angles, axis / np.linalg.norm(axis)))
    np.testing.assert_allclose(found, angles, atol=1e-7)


def test_past_a_full_turn_it_falls_again():
    angles = np.linspace(0.0, 3 * np.pi, 200)
    found = unfolded_angles(spin(angles, np.array([0.0, 1.0, 0.0])))
    np.testing.assert_allclose(found, np.minimum(angles, 4 * np.pi - angles), atol=1e-7)


def test_it_is_the_folded_angle_or_what_is_left_of_a_full_turn():
    steps = Rotation.from_rotvec(0.5 * np.random.default_rng(0).normal(size=(600, 3)))
    path = [Rotation.identity()]
    for step in steps:
        path.append(path[-1] * step)
    R = np.stack([r.as_matrix() for r in path])
    folded = rotation_angle(R, np.broadcast_to(np.eye(3), R.shape))
    found = unfolded_angles(R)
    np.testing.assert_allclose(np.minimum(found, 2 * np.pi - found), folded, atol=1e-6)
    assert found.max() > np.pi + 0.5


def test_many_series_at_once():
    R = np.stack([spin(np.linspace(0, end, 50), np.eye(3)[i]) for i, end in enumerate((1, 4, 6))])
    together = unfolded_angles(np.swapaxes(R, 0, 1))
    for i in range(3):
        np.testing.assert_allclose(together[:, i], unfolded_angles(R[i]), atol=1e-12)
