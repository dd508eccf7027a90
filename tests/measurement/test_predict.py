"""Readings against `site_motion`, derivatives against forward-mode differentiation of it."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax import so3
from mocap_jax.body import Body, load_body, retract, site_motion
from mocap_jax.measurement import predict
from mocap_jax.measurement.chain import chain

XML = """<mujoco><worldbody><body name="pelvis" pos="0.1 0.2 1"><freejoint name="root"/>
<geom size=".1"/><site name="s0" pos=".1 .02 .03" quat=".8 .2 .3 .4"/>
<body name="thigh" pos="0 .1 -.1" quat=".9 .1 .2 .1"><joint name="hip" type="ball" pos=".01 .02 0"/>
<geom size=".1"/><site name="s1" pos=".03 0 -.2" quat=".5 .2 .3 -.4"/>
<body name="shank" pos="0 0 -.4"><joint name="slide" type="slide" axis="0 .3 1"/>
<joint name="knee" axis="0 1 .2" pos=".01 0 .02"/><joint name="twist" axis="0 .1 1"/>
<geom size=".1"/><site name="s2" pos="0 .04 -.3" quat=".3 .2 .7 -.4"/></body></body>
<body name="arm" pos="0 .1 .4"><joint name="a1" axis="1 0 0"/><joint name="a2" axis="0 1 0"/>
<geom size=".1"/><site name="s3" pos="0 .3 0"/></body></body></worldbody></mujoco>"""
SITES = (0, 1, 2, 3)


@pytest.fixture(scope="module")
def body() -> Body:
    return load_body(XML)


@pytest.fixture(scope="module")
def state(body: Body) -> tuple[jax.Array, ...]:
    rng = np.random.default_rng(1)
    q = retract(body.topology, body.qpos0, jnp.asarray(rng.normal(0, 0.7, body.nv)))
    return q, jnp.asarray(rng.normal(0, 2, body.nv)), jnp.asarray(rng.normal(0, 9, body.nv))


def _reference(body: Body, state: tuple, read) -> jax.Array:
    """Derivative of read(site_motion) with respect to (dq, dv, da)."""
    q, v, a = state
    n = body.nv

    def h(d: jax.Array) -> jax.Array:
        return read(site_motion(body, retract(body.topology, q, d[:n]), v + d[n : 2 * n],
                                a + d[2 * n :]))  # fmt: skip

    return jax.jit(jax.jacfwd(h))(jnp.zeros(3 * n))


def test_specific_force(body: Body, state: tuple) -> None:
    def read(m):
        return so3.matvec3(jnp.swapaxes(m.rotation, 1, 2), m.acceleration - body.gravity)

    p = predict.specific_force(body, chain(body, *state), SITES)
    np.testing.assert_allclose(p.value, read(site_motion(body, *state)), atol=1e-11)
    np.testing.assert_allclose(p.jacobian, _reference(body, state, read), atol=1e-10)


def test_rate(body: Body, state: tuple) -> None:
    def read(m):
        return so3.matvec3(jnp.swapaxes(m.rotation, 1, 2), m.angular_velocity)

    p = predict.rate(body, chain(body, *state), SITES)
    np.testing.assert_allclose(p.value, read(site_motion(body, *state)), atol=1e-12)
    want = _reference(body, state, read)
    np.testing.assert_allclose(p.jacobian, want[..., : 2 * body.nv], atol=1e-11)
    assert np.abs(want[..., 2 * body.nv :]).max() == 0


def test_orientation(body: Body, state: tuple) -> None:
    p = predict.orientation(body, chain(body, *state), SITES)
    R0 = p.value

    def read(m):
        return jax.vmap(so3.log)(so3.matmul3(jnp.swapaxes(R0, 1, 2), m.rotation))

    want = _reference(body, state, read)[..., : body.nv]
    np.testing.assert_allclose(p.jacobian, want, atol=1e-11)


def test_distance(body: Body, state: tuple) -> None:
    source, receiver = jnp.array([0, 0, 3]), jnp.array([1, 2, 2])
    lead, travel = jnp.array([0.0, 0.003, 0.006]), jnp.array([0.001, 0.002, 0.003])

    def read(m):
        at = lambda i, t: m.position[i] + t[:, None] * m.velocity[i] + (  # noqa: E731
            0.5 * t[:, None] ** 2 * jax.lax.stop_gradient(m.acceleration[i]))  # fmt: skip
        return jnp.linalg.norm(at(receiver, travel - lead) - at(source, -lead), axis=1)

    p = predict.distance(body, chain(body, *state), SITES, source, receiver, lead, travel)
    np.testing.assert_allclose(p.value, read(site_motion(body, *state)), atol=1e-12)
    want = _reference(body, state, read)
    n = 2 * body.nv
    np.testing.assert_allclose(p.jacobian[:, :n], want[:, :n], atol=1e-10)


def test_root_pose(body: Body, state: tuple) -> None:
    R, p, J = predict.root_pose(body, state[0])
    np.testing.assert_allclose(p, state[0][:3], atol=1e-12)
    np.testing.assert_allclose(R, so3.quat_to_matrix(so3.quat_normalise(state[0][3:7])), atol=1e-12)
    np.testing.assert_allclose(J[:, :6], np.eye(6), atol=1e-12)
    assert np.abs(J[:, 6:]).max() == 0


def test_magnetic_field(body: Body, state: tuple) -> None:
    field = jnp.array([2e-5, 1e-6, -4e-5])

    def read(m):
        return so3.matvec3(jnp.swapaxes(m.rotation, 1, 2), jnp.broadcast_to(field, (4, 3)))

    p = predict.magnetic_field(body, chain(body, *state), SITES, field)
    np.testing.assert_allclose(p.value, read(site_motion(body, *state)), atol=1e-18)
    want = _reference(body, state, read)
    np.testing.assert_allclose(p.jacobian, want[..., : body.nv], atol=1e-17)
    assert np.abs(want[..., body.nv :]).max() == 0
