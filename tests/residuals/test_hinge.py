"""Departure of a joint from a hinge."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.residuals.hinge import hinge_residual

AXIS = np.array([0.6, 0.0, 0.8])
REFERENCE = Rotation.from_rotvec([0.3, -0.2, 0.5])


def residual(turn: Rotation) -> np.ndarray:
    quaternions = [r.as_quat(scalar_first=True) for r in (REFERENCE * turn, REFERENCE)]
    return np.asarray(hinge_residual(*map(jnp.asarray, quaternions), jnp.asarray(AXIS)))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.7, -2.4])
def test_a_hinge_has_none(angle: float) -> None:
    np.testing.assert_allclose(residual(Rotation.from_rotvec(angle * AXIS)), 0.0, atol=1e-14)


def test_other_rotations_count_in_full() -> None:
    off = np.array([-0.08, 0.1, 0.06])
    assert off @ AXIS == pytest.approx(0)
    np.testing.assert_allclose(residual(Rotation.from_rotvec(off + 0.4 * AXIS)), off, atol=1e-14)


def test_derivative_is_finite_at_the_reference() -> None:
    q = jnp.asarray(REFERENCE.as_quat(scalar_first=True))
    assert np.isfinite(jax.jacfwd(lambda x: hinge_residual(x, q, jnp.asarray(AXIS)))(q)).all()
