"""The pose prior's residual against SciPy's rotations."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.residuals.pose_prior import pose_prior_rotation


def _draw(seed: int, count: int) -> Rotation:
    return Rotation.random(count, random_state=seed)


def test_against_scipy() -> None:
    child, parent, frame, mean = (_draw(i, 5) for i in range(4))
    found = pose_prior_rotation(*(jnp.asarray(r.as_matrix()) for r in (child, parent, frame, mean)))
    expected = ((parent * mean).inv() * child * frame).as_rotvec()
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_slope_at_the_mean_is_finite() -> None:
    eye = jnp.eye(3)[None]

    def squared(x: jax.Array) -> jax.Array:
        turned = jax.scipy.linalg.expm(jnp.array([[0, -x, 0], [x, 0, 0], [0, 0, 0]]))[None]
        return (pose_prior_rotation(turned, eye, eye, eye) ** 2).sum()

    assert float(jax.grad(squared)(0.0)) == 0.0
    np.testing.assert_allclose(float(jax.grad(jax.grad(squared))(0.0)), 2.0, rtol=1e-6)
