"""How far an orientation is from what a hinge or a universal joint allows."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.residuals.joint_axes import one_axis_residual, two_axes_residual

FIRST, SECOND = np.array([0.6, 0.0, 0.8]), np.array([0.0, -1.0, 0.0])
START = Rotation.from_rotvec([0.3, -0.2, 0.5])


def test_turns_about_the_hinge_are_free_and_others_count_by_their_angle() -> None:
    second = START.inv().apply(FIRST)
    R = (Rotation.from_rotvec(1.9 * FIRST) * START).as_matrix()
    np.testing.assert_allclose(one_axis_residual(jnp.asarray(R), FIRST, second), 0, atol=1e-12)
    across = np.array([0.8, 0.0, -0.6])
    R = (Rotation.from_rotvec(0.01 * across) * START).as_matrix()
    off = np.asarray(one_axis_residual(jnp.asarray(R), FIRST, second))
    assert np.linalg.norm(off) == pytest.approx(0.01, rel=1e-4)


def test_turns_about_both_axes_are_free_and_the_angle_between_them_counts() -> None:
    cosine = float(FIRST @ START.apply(SECOND))
    turned = Rotation.from_rotvec(0.7 * FIRST) * START * Rotation.from_rotvec(-2.1 * SECOND)
    off = two_axes_residual(jnp.asarray(turned.as_matrix()), FIRST, SECOND, cosine)
    assert float(off) == pytest.approx(0.0, abs=1e-12)
    # Opening the angle between the axes by 0.01.
    normal = np.cross(FIRST, START.apply(SECOND))
    opened = Rotation.from_rotvec(0.01 * normal / np.linalg.norm(normal)) * START
    off = two_axes_residual(jnp.asarray(opened.as_matrix()), FIRST, SECOND, cosine)
    assert float(off) == pytest.approx(-0.01 * np.sqrt(1 - cosine**2), rel=0.02)
