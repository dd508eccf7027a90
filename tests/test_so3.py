"""Rotations against SciPy, finite differences and closed forms.

Round trips hold to 1e-14 at every angle, half turns included; derivatives are finite everywhere.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax import so3

ANGLES = (0.0, 1e-12, 1e-8, 1e-5, 9.99e-4, 1.001e-3, 9.99e-3, 1.001e-2, 0.5, 2.0, np.pi - 1e-6)
rng = np.random.default_rng(0)
directions = rng.normal(size=(40, 3))
directions /= np.linalg.norm(directions, axis=1, keepdims=True)
# The axes themselves and diagonals, where the four forms of a quaternion change places.
directions = np.concatenate([np.eye(3), -np.eye(3), [[0.6, 0.8, 0], [0, -0.6, 0.8]], directions])
vectors = np.concatenate([angle * directions for angle in ANGLES])
quats = rng.normal(size=(300, 4))
quats /= np.linalg.norm(quats, axis=1, keepdims=True)


def scipy(quat: np.ndarray) -> Rotation:
    return Rotation.from_quat(quat, scalar_first=True)


def up_to_sign(quat, reference) -> float:
    sign = np.sign((np.asarray(quat) * reference).sum(axis=-1, keepdims=True))
    return float(np.abs(sign * np.asarray(quat) - reference).max())


def test_exp_is_scipys() -> None:
    expected = Rotation.from_rotvec(vectors)
    np.testing.assert_allclose(so3.exp(vectors), expected.as_matrix(), atol=1e-15 * 4)
    assert up_to_sign(so3.quat_exp(vectors), expected.as_quat(scalar_first=True)) < 1e-15


def test_log_is_scipys() -> None:
    expected = scipy(quats).as_rotvec()
    np.testing.assert_allclose(so3.quat_log(quats), expected, atol=1e-14)
    np.testing.assert_allclose(so3.log(scipy(quats).as_matrix()), expected, atol=1e-13)


def test_matrices_and_products_are_scipys() -> None:
    other = quats[::-1]
    np.testing.assert_allclose(so3.quat_to_matrix(quats), scipy(quats).as_matrix(), atol=1e-15)
    assert up_to_sign(so3.quat_from_matrix(scipy(quats).as_matrix()), quats) < 4e-15
    product = (scipy(quats) * scipy(other)).as_quat(scalar_first=True)
    assert up_to_sign(so3.quat_multiply(quats, other), product) < 4e-15
    inverse = scipy(quats).inv().as_quat(scalar_first=True)
    assert up_to_sign(so3.quat_conjugate(quats), inverse) < 4e-15


def test_log_undoes_exp() -> None:
    np.testing.assert_allclose(so3.quat_log(so3.quat_exp(vectors)), vectors, atol=1e-14)
    np.testing.assert_allclose(so3.log(so3.exp(vectors)), vectors, atol=1e-14)


def test_small_rotations_keep_their_relative_accuracy() -> None:
    for angle in (1e-12, 1e-8, 1e-5):
        w = angle * directions
        np.testing.assert_allclose(so3.quat_log(so3.quat_exp(w)), w, rtol=1e-14, atol=1e-28)
        np.testing.assert_allclose(so3.log(so3.exp(w)), w, atol=1e-15)


def test_half_turns() -> None:
    R = so3.exp(np.pi * directions)
    w = np.asarray(so3.log(R))
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), np.pi, atol=1e-14)
    np.testing.assert_allclose(so3.exp(w), R, atol=1e-14)
    exact = np.concatenate([np.zeros((len(directions), 1)), directions], axis=1)
    np.testing.assert_allclose(so3.quat_log(exact), np.pi * directions, atol=1e-14)


def test_log_is_shortest() -> None:
    beyond = so3.log(so3.exp((np.pi + 0.3) * directions))
    np.testing.assert_allclose(beyond, (0.3 - np.pi) * directions, atol=1e-14)


def test_products_and_cross_are_numpys() -> None:
    a, b = rng.normal(size=(2, 50, 3, 3))
    x = rng.normal(size=(50, 3))
    np.testing.assert_allclose(so3.matmul3(a, b), a @ b, atol=1e-14)
    np.testing.assert_allclose(so3.matvec3(a, x), np.einsum("nij,nj->ni", a, x), atol=1e-14)
    np.testing.assert_allclose(so3.cross(x, b[:, 0]), np.cross(x, b[:, 0]), atol=1e-15 * 4)
    np.testing.assert_allclose(so3.matvec3(so3.skew(x), b[:, 0]), np.cross(x, b[:, 0]), atol=1e-14)


def test_right_jacobian_agrees_with_finite_differences() -> None:
    step = 1e-5
    for column, e in enumerate(step * np.eye(3)):
        at = so3.quat_conjugate(so3.quat_exp(vectors))
        ahead = so3.quat_log(so3.quat_multiply(at, so3.quat_exp(vectors + e)))
        behind = so3.quat_log(so3.quat_multiply(at, so3.quat_exp(vectors - e)))
        expected = (ahead - behind) / (2 * step)
        np.testing.assert_allclose(so3.right_jacobian(vectors)[:, :, column], expected, atol=1e-9)


def test_right_jacobian_inverse() -> None:
    product = so3.matmul3(so3.right_jacobian_inverse(vectors), so3.right_jacobian(vectors))
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-11)


def test_right_jacobian_is_the_derivative_of_exp() -> None:
    derivative = jax.jit(jax.vmap(jax.jacfwd(so3.exp)))(vectors)
    local = jnp.einsum("nji,njkd->nikd", so3.exp(vectors), derivative)
    columns = jnp.stack([local[:, 2, 1], local[:, 0, 2], local[:, 1, 0]], axis=1)
    np.testing.assert_allclose(columns, so3.right_jacobian(vectors), atol=1e-11)


def round_trip(w):
    return so3.log(so3.exp(w))


@pytest.mark.parametrize("function", [
    so3.exp, so3.quat_exp, so3.right_jacobian, so3.right_jacobian_inverse, round_trip,
], ids=lambda f: f.__name__)  # fmt: skip
def test_derivatives_are_finite(function) -> None:
    every = np.concatenate([vectors, np.pi * directions])
    scalar = lambda w: (function(w) ** 2).sum() + function(w).sum()  # noqa: E731
    assert np.isfinite(jax.jit(jax.vmap(jax.grad(scalar)))(every)).all()


def test_second_derivatives_of_exp_are_finite() -> None:
    every = np.concatenate([vectors, np.pi * directions])
    assert np.isfinite(jax.jit(jax.vmap(jax.hessian(so3.exp)))(every)).all()


def test_derivative_of_the_round_trip_is_one() -> None:
    jacobian = jax.jit(jax.vmap(jax.jacfwd(round_trip)))(vectors)
    np.testing.assert_allclose(jacobian, np.broadcast_to(np.eye(3), jacobian.shape), atol=1e-9)


def test_derivatives_of_log_are_finite_at_the_identity_and_half_turns() -> None:
    at = jnp.array([[1.0, 0, 0, 0], [-1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])
    for function, values in ((so3.quat_log, at), (so3.log, so3.quat_to_matrix(at))):
        for derivative in (jax.jacfwd, jax.jacrev):
            assert np.isfinite(jax.jit(jax.vmap(derivative(function)))(values)).all()
