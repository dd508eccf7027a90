"""Beliefs of a filter are cut off at the ranges of hinges and slides, and at no others."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax.body import load_body
from mocap_jax.estimate.joint_ranges import within_ranges
from mocap_jax.kalman import State

BODY = load_body("""<mujoco><compiler angle="radian"/><worldbody><body><freejoint/><geom size=".1"/>
<body><joint name="elbow" axis="0 0 1" range="0 2"/><geom size=".1"/>
<body><joint name="free" axis="0 0 1"/><geom size=".1"/>
<body><joint name="ball" type="ball" range="0 0.1"/><geom size=".1"/></body></body></body></body>
</worldbody></mujoco>""")


def belief(elbow: float) -> State:
    q = np.array(BODY.qpos0)
    q[7], q[8] = elbow, -9.0
    rng = np.random.default_rng(0)
    A = rng.normal(size=(3 * BODY.nv, 3 * BODY.nv))
    P = 0.01 * (A @ A.T / len(A) + np.eye(len(A)))
    zero = jnp.zeros(BODY.nv)
    return State(jnp.asarray(q), zero, zero, jnp.asarray(P))


def test_both_ends_of_a_range_are_kept() -> None:
    for elbow in (-0.3, 2.3):
        before = belief(elbow)
        after = within_ranges(BODY, before)
        assert 0 < after.q[7] < 2
        assert after.covariance[6, 6] < before.covariance[6, 6]
        # What is correlated with the elbow follows it.
        gain = before.covariance[:, 6] / before.covariance[6, 6]
        moved = (after.q[7] - elbow) * gain
        np.testing.assert_allclose(after.v, moved[BODY.nv : 2 * BODY.nv], atol=1e-9)
        np.testing.assert_allclose(after.q[8] + 9.0, moved[7], atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(after.q[3:7]), 1.0)


def test_within_the_range_nothing_changes() -> None:
    before = belief(1.0)
    after = within_ranges(BODY, before)
    np.testing.assert_allclose(after.q, before.q, atol=1e-9)
    np.testing.assert_allclose(after.covariance, before.covariance, atol=1e-9)


def test_derivatives_are_those_of_differences() -> None:
    """The body has a hinge without a range."""
    start = belief(1.8)
    rng = np.random.default_rng(2)
    weights = jax.tree.map(lambda x: jnp.asarray(rng.normal(size=x.shape)), start)
    direction = State(
        jnp.asarray(rng.normal(size=start.q.shape)), *(jnp.zeros_like(x) for x in start[1:3]),
        0.01 * jnp.eye(len(start.covariance)),
    )  # fmt: skip

    @jax.jit
    def value(s: jax.Array) -> jax.Array:
        after = within_ranges(BODY, jax.tree.map(lambda x, d: x + s * d, start, direction))
        return sum((w * x).sum() for w, x in zip(weights, after, strict=True))

    h = 1e-6
    expected = (value(jnp.asarray(h)) - value(jnp.asarray(-h))) / (2 * h)
    np.testing.assert_allclose(jax.grad(value)(jnp.asarray(0.0)), expected, rtol=1e-6)
