"""Calculus on poses against C MuJoCo (1e-12) and finite differences."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from sample_bodies import random_states, sample_body, worst

from mocap_jax.body import difference, normalise, retract, transport
from mocap_jax.body.tangent import velocity_to_tangent

COUNT = 200
body = sample_body("mixed")
topology = body.topology
q, delta, _ = random_states(body, COUNT)
q_other = random_states(body, COUNT, seed=7)[0]
# From nothing over tiny to just less than half a turn: the range in which tangents are unique.
scale = np.resize([0.0, 1e-9, 1e-4, 0.1, 1.0], COUNT)[:, None]
delta = scale * delta
for block in topology.quat_index[1]:
    turn = np.linalg.norm(delta[:, block], axis=1, keepdims=True)
    delta[:, block] *= np.minimum(1.0, (np.pi - 1e-6) / np.maximum(turn, 1e-300))


def batched(function):
    return jax.jit(jax.vmap(lambda *args: function(topology, *args)))


def test_retract_is_mujocos() -> None:
    model = body.mujoco_model()
    expected = q.copy()
    for row, step in zip(expected, delta, strict=True):
        mujoco.mj_integratePos(model, row, step, 1.0)
    assert worst(batched(retract)(q, delta), expected) < 1e-12


def test_difference_is_mujocos() -> None:
    model = body.mujoco_model()
    expected = np.zeros_like(delta)
    for row, start, end in zip(expected, q, q_other, strict=True):
        mujoco.mj_differentiatePos(model, row, 1.0, start, end)
    assert worst(batched(difference)(q, q_other), expected) < 1e-12


def test_difference_undoes_retract() -> None:
    back = batched(difference)(q, batched(retract)(q, delta))
    np.testing.assert_allclose(back, delta, atol=2e-15 * 1e2)


def test_retract_undoes_difference() -> None:
    moved = np.array(batched(retract)(q, batched(difference)(q, q_other)))
    for quat in topology.quat_index[0]:
        sign = np.sign((moved[:, quat] * q_other[:, quat]).sum(axis=1, keepdims=True))
        moved[:, quat] *= sign
    np.testing.assert_allclose(moved, q_other, atol=1e-13)


def test_difference_is_the_same_for_either_sign_of_a_quaternion() -> None:
    flipped = q_other.copy()
    flipped[:, topology.quat_index[0].ravel()] *= -1
    np.testing.assert_allclose(
        batched(difference)(q, flipped), batched(difference)(q, q_other), atol=1e-14
    )


def test_transport_agrees_with_finite_differences() -> None:
    step = 1e-6
    error = np.random.default_rng(4).normal(size=delta.shape)
    there = batched(retract)(q, delta)
    ahead = batched(difference)(there, batched(retract)(q, delta + step * error))
    behind = batched(difference)(there, batched(retract)(q, delta - step * error))
    moved = batched(transport)(delta, error)
    np.testing.assert_allclose(moved, (ahead - behind) / (2 * step), atol=1e-8)


def test_transport_of_a_matrix_is_that_of_its_columns() -> None:
    columns = jnp.asarray(np.random.default_rng(5).normal(size=(body.nv, 4)))
    moved = transport(topology, delta[4], columns)
    for k in range(4):
        expected = transport(topology, delta[4], columns[:, k])
        np.testing.assert_allclose(moved[:, k], expected, atol=1e-14)


@pytest.mark.parametrize("norm", [1.0, 1.3])
def test_velocity_to_tangent_is_the_derivative_of_difference(norm: float) -> None:
    """Quaternions need not be of unit length, as within a differentiated program."""
    quats = topology.quat_index[0].ravel()
    scaled = q.copy()
    scaled[:, quats] *= norm
    dq = np.random.default_rng(6).normal(size=q.shape)

    def reference(topology, q, dq):
        from_here = lambda x: difference(topology, normalise(topology, q), normalise(topology, x))  # noqa: E731
        return jax.jvp(from_here, (q,), (dq,))[1]

    ours = batched(velocity_to_tangent)(scaled, dq)
    np.testing.assert_allclose(ours, batched(reference)(scaled, dq), atol=1e-12)


def test_normalise() -> None:
    quats = topology.quat_index[0].ravel()
    scaled = q.copy()
    scaled[:, quats] *= 3.0
    np.testing.assert_allclose(batched(normalise)(scaled), q, atol=1e-15)


def test_derivatives_at_no_motion_are_finite_and_one() -> None:
    for pose in jnp.asarray(q[:3]):
        jacobian = jax.jacfwd(
            lambda d, pose=pose: difference(topology, pose, retract(topology, pose, d))
        )(jnp.zeros(body.nv))
        np.testing.assert_allclose(jacobian, np.eye(body.nv), atol=1e-13)
