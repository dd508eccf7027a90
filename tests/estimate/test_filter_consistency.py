"""Motions drawn from the filter's own prior: its covariance must then be right."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import pytest
from synthetic import SENSORS, small_body

from mocap_jax import so3
from mocap_jax.body import Body, difference, retract, site_motion
from mocap_jax.estimate.filter_frame import filter_frame
from mocap_jax.estimate.filter_model import FilterModel, FrameInput, Parameters
from mocap_jax.kalman import Dynamics, SigmaPoints, State, process_noise

RUNS, FRAMES, RATE = 100, 120, 140.0
ACCELEROMETER, GYROSCOPE, ROOT = 0.02, 0.002, (0.005, 0.01)


def _parameters(body: Body) -> Parameters:
    h = jnp.asarray(1 / RATE)
    s = len(SENSORS)
    return Parameters(
        Dynamics(h, process_noise("white_jerk", h, jnp.full(body.nv, 200.0))),
        jnp.full(s, ACCELEROMETER), jnp.full(s, GYROSCOPE), jnp.full(s, 0.02),
        jnp.asarray(0.0025), jnp.array([ROOT[0]] * 3 + [ROOT[1]] * 3),
        jnp.asarray(0.0), jnp.asarray(0.0), jnp.asarray(343.0), jnp.zeros(4),
    )  # fmt: skip


def _start(body: Body) -> jax.Array:
    """At rest in a pose known to half a degree: the filter linearises, so errors must be small."""
    sigma = [0.01] * body.nv + [0.02] * body.nv + [0.5] * body.nv
    return jnp.diag(jnp.array(sigma) ** 2)


def _nees(body: Body, model: FilterModel, parameters: Parameters, key: jax.Array) -> jax.Array:
    """Squared pose error in units of the claimed covariance, per frame."""
    nv, topology = body.nv, body.topology
    keys = jax.random.split(key, 2)
    P0 = _start(body)
    start = State(body.qpos0, jnp.zeros(nv), jnp.zeros(nv), P0)
    e = jnp.sqrt(jnp.diagonal(P0)) * jax.random.normal(keys[0], (3 * nv,))
    truth = (retract(topology, start.q, e[:nv]), e[nv : 2 * nv], e[2 * nv :])
    root_Q = jnp.linalg.cholesky(parameters.dynamics.noise[:, :, 0] + 1e-22 * jnp.eye(3))

    def step(carry: tuple, inputs: tuple) -> tuple:
        (q, v, a), state = carry
        key, first = inputs
        k = jax.random.split(key, 6)
        w = jnp.where(first, 0.0, root_Q @ jax.random.normal(k[0], (3, nv)))
        h = jnp.where(first, 0.0, parameters.dynamics.step)
        q = retract(topology, retract(topology, q, v * h + a * h**2 / 2), w[0])
        v, a = v + h * a + w[1], a + w[2]
        frame = _measure(body, model, (q, v, a), k[1:], first)
        state, _ = filter_frame(body, model, parameters, state, frame)
        error = difference(topology, state.q, q)
        P = state.covariance[:nv, :nv]
        return ((q, v, a), state), error @ jnp.linalg.solve(P, error)

    first = jnp.arange(FRAMES) == 0
    return jax.lax.scan(step, (truth, start), (jax.random.split(keys[1], FRAMES), first))[1]


def _measure(body: Body, model: FilterModel, x: tuple, k: jax.Array, first: jax.Array):
    m = site_motion(body, *x)
    at = jnp.array(model.sensors)
    R = jnp.swapaxes(m.rotation[at], 1, 2)
    n = lambda key, shape: jax.random.normal(key, shape)  # noqa: E731
    force = so3.matvec3(R, m.acceleration[at] - body.gravity) + ACCELEROMETER * n(k[0], (3, 3))
    rate = so3.matvec3(R, m.angular_velocity[at]) + GYROSCOPE * n(k[1], (3, 3))
    turn = so3.quat_exp(ROOT[1] * n(k[3], (3,)))
    none = jnp.zeros(1)
    return FrameInput(
        jnp.asarray(True), first, force, rate, jnp.full((3, 4), jnp.nan), none + 1, none,
        none.astype(int), none.astype(int), none, x[0][:3] + ROOT[0] * n(k[2], (3,)),
        so3.quat_multiply(x[0][3:7], turn), jnp.full((3, 3), jnp.nan),
    )  # fmt: skip


@pytest.mark.parametrize("points", [None, SigmaPoints()], ids=["extended", "unscented"])
def test_errors_are_as_large_as_claimed(points: SigmaPoints | None) -> None:
    body = small_body()
    sites = tuple(body.site_index(s) for s in SENSORS)
    model = FilterModel("white_jerk", "GAR", sites, (), 0.0, sigma_points=points)
    run = jax.jit(jax.vmap(partial(_nees, body, model, _parameters(body))))
    nees = run(jax.random.split(jax.random.PRNGKey(0), RUNS)) / body.nv
    assert nees.shape == (RUNS, FRAMES)
    assert 0.9 < float(nees[:, 10:].mean()) < 1.1
    assert 0.9 < float(nees[:, -1].mean()) < 1.1
