"""The tilt that a still board tells: its size and axis, and its derivative."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax import so3
from mocap_jax.residuals.gravity import tilt_error

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("angle", [0.0, 0.1, 1.2, np.pi - 1e-3])
def test_sine_and_axis_of_a_tilt(angle: float) -> None:
    R = Rotation.from_rotvec([0.4, -0.7, 1.1])
    axis = np.array([0.6, -0.8, 0.0])
    wrong = Rotation.from_rotvec(angle * axis) * R
    force = 9.6 * R.inv().apply(UP)
    error = tilt_error(jnp.asarray(wrong.as_matrix()), jnp.asarray(force), jnp.asarray(UP))
    np.testing.assert_allclose(error, np.sin(angle) * axis, atol=1e-12)


def test_turns_about_the_vertical_are_no_tilt() -> None:
    R = Rotation.from_rotvec([0.0, 0.0, 2.0]) * Rotation.from_rotvec([0.4, -0.7, 1.1])
    force = R.inv().apply(9.81 * UP)
    np.testing.assert_allclose(tilt_error(R.as_matrix(), force, UP), 0.0, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi - 1e-6])
def test_derivative(angle: float) -> None:
    """Against central differences, at zero and near half a turn too; finite without a force."""
    R = Rotation.from_rotvec([angle, 0.0, 0.0]).as_matrix()
    force = np.array([0.0, 0.0, 9.81])

    def error(x: jax.Array) -> jax.Array:
        return tilt_error(so3.exp(x[:3]) @ R, jnp.asarray(force) + x[3:], jnp.asarray(UP))

    slope = np.asarray(jax.jacfwd(error)(jnp.zeros(6)))
    steps = 1e-6 * np.eye(6)
    ahead = np.array([(error(s) - error(-s)) / 2e-6 for s in jnp.asarray(steps)]).T
    np.testing.assert_allclose(slope, ahead, atol=1e-8)
    assert np.abs(slope[:, :3]).max() > 0.5
    nothing = jax.jacfwd(lambda f: tilt_error(jnp.asarray(R), f, jnp.asarray(UP)))(jnp.zeros(3))
    assert np.isfinite(np.asarray(nothing)).all()
