"""On a linear problem with a border, smoother, Gauss-Newton step and dense solution are one.

A body of slide joints is linear in its coordinates. The paper's Euler process is a third
difference driven by white noise, h^2 w_k, so poses alone carry it exactly, and the second
difference centred at frame k is the process's acceleration at frame k - 1. The accelerometer's
bias and mounting are constants: a border for the optimiser, further states for the smoother,
further columns for the dense solution. (The mounting is linear only to first order: all three
solve the problem linearised at zero, which is what one Gauss-Newton step does.)
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax import linalg, so3
from mocap_jax.body import Body, load_body
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.kalman import (
    Dynamics,
    predict,
    process_noise,
    smooth_step,
    update,
    vector_space,
)
from mocap_jax.kalman import State as Belief
from mocap_jax.least_squares import SolverOptions, minimise
from mocap_jax.residuals.inertial import CONSISTENT

XML = """<mujoco><worldbody><body name="cart"><joint type="slide" axis="1 0 0"/>
<joint type="slide" axis="0 1 0"/><geom size=".1"/>
<body name="lift" pos="0 .1 .2"><joint type="slide" axis=".36 .48 .8"/><geom size=".1"/>
<site name="board" pos=".1 0 .2" quat=".8 .2 .4 .4"/></body></body></worldbody></mujoco>"""
T, STEP = 30, 0.05
DENSITY = np.array([2.0, 0.5, 1.0])
START_SIGMA, POSITION_SIGMA, FORCE_SIGMA = 0.5, 0.02, 0.1
# Gyroscope bias, accelerometer bias, mounting rotation and offset of the board. Without rotation
# nothing sees the first and the last.
CONSTANT_SIGMA = np.repeat([0.01, 0.3, 0.05, 0.01], 3)
M = len(CONSTANT_SIGMA)


class Data(NamedTuple):
    """One random problem."""

    body: Body
    start: np.ndarray
    """(3, nv) prior means of the first three poses."""
    position: np.ndarray
    """(t, nv) measured poses."""
    seen: np.ndarray
    """(t, nv) which of them exist."""
    force: np.ndarray
    """(t, 3) specific forces."""


class Posterior(NamedTuple):
    """Means and marginal covariances of poses, and of the constants."""

    q: np.ndarray
    covariance: np.ndarray
    constants: np.ndarray
    constants_covariance: np.ndarray


@pytest.fixture(scope="module")
def data() -> Data:
    body, rng = load_body(XML), np.random.default_rng(5)
    draw = lambda *shape: rng.normal(size=shape)  # noqa: E731
    seen = rng.uniform(size=(T, body.nv)) < 0.4
    up = np.array(_rotation().T @ [0, 0, 9.81])
    return Data(body, 0.1 * draw(3, body.nv), 0.3 * draw(T, body.nv), seen, up + draw(T, 3))


def _rotation() -> np.ndarray:
    """R_world_site; constant, since nothing turns."""
    return np.asarray(so3.quat_to_matrix(jnp.array([0.8, 0.2, 0.4, 0.4])))


def _axes() -> np.ndarray:
    """Derivative (3, nv) of the board's world position by the pose."""
    return np.array([[1, 0, 0.36], [0, 1, 0.48], [0, 0, 0.8]])


def _skew(f: np.ndarray) -> np.ndarray:
    return np.array([[0, -f[2], f[1]], [f[2], 0, -f[0]], [-f[1], f[0], 0]])


def _force_row(d: Data, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Accelerometer at centre k: measured world acceleration (3,) and columns (3, m).

    R exp(m) (f - b) + g = D a, so to first order R f + g = D a + R b + R skew(f) m.
    """
    R, gravity = _rotation(), np.array([0, 0, -9.81])
    f = sum(c * d.force[k + i] for i, c in zip((-1, 0, 1), CONSISTENT, strict=True))
    o = np.zeros((3, 3))
    return R @ f + gravity, np.hstack([o, R, R @ _skew(f), o])


def _optimiser(d: Data, chunk: int) -> tuple[SequenceProblem, State]:
    nv = d.body.nv
    inside = lambda a, b: ((np.arange(T) >= a) & (np.arange(T) < T - b)).astype(float)[:, None]  # noqa: E731
    reference, information = np.zeros((2, T, nv)), np.zeros((2, T, nv))
    reference[0, :3], information[0, :3] = d.start, START_SIGMA**-2
    reference[1], information[1] = d.position, d.seen / POSITION_SIGMA**2
    layout = Layout(
        topology=d.body.topology, sites=(d.body.site_index("board"),), range_sites=(),
        root_body=1, use_acceleration=True, use_rate=False, use_orientation=False,
        use_range=False, use_border=True, force_weights=CONSISTENT, smoothness_order=3,
        inertial_loss="none", range_loss="none", chunk=chunk,
    )  # fmt: skip
    none = np.zeros((T, 1))
    terms = Terms(
        force=d.force[:, None], force_information=inside(1, 1) / FORCE_SIGMA**2,
        rate=np.zeros((T, 1, 3)), mean_rate=np.zeros((T, 1, 3)), rate_information=none,
        orientation=np.tile(np.eye(3), (T, 1, 1, 1)), orientation_information=none,
        range_distance=none, range_information=none, range_source=none.astype(int),
        range_receiver=none.astype(int), range_lead=none, range_flight=none,
        reference=reference, reference_information=information,
        smoothness_information=inside(1, 2) * STEP / DENSITY, limit_information=np.zeros(T),
        pose_information=np.zeros(T), pace_information=np.zeros(T),
    )  # fmt: skip
    weights = Weights(
        step=np.asarray(STEP), inertial_scale=np.ones((3, 1)), range_scale=np.asarray(1.0),
        range_mu=np.asarray(1.0), limit_softness=np.asarray(0.1),
    )  # fmt: skip
    problem = SequenceProblem(layout, d.body, terms, weights, CONSTANT_SIGMA[None] ** -2)
    none = np.zeros((1, 3))
    zero = Constants(
        gyroscope_bias=none, accelerometer_bias=none, mounting=np.eye(3)[None], offset=none
    )
    return problem, State(np.zeros((T, nv)), zero)


def _gauss_newton(d: Data, chunk: int) -> Posterior:
    problem, start = _optimiser(d, chunk)
    result = minimise(problem, start, SolverOptions(max_iterations=1, initial_damping=0.0))
    c = result.state.constants
    turn = so3.log(jnp.asarray(c.mounting))
    constants = np.concatenate([c.gyroscope_bias, c.accelerometer_bias, turn, c.offset], axis=1)
    equations = problem.linearise(start)
    f = linalg.factor(equations.lower, equations.corner, equations.border)
    return Posterior(
        result.state.q, linalg.marginals(f, equations.border),
        constants[0], linalg.corner_covariance(f),
    )  # fmt: skip


def _dense(d: Data) -> Posterior:
    """Rows of a whitened Jacobian over all unknowns, solved by QR."""
    nv = d.body.nv
    n = T * nv
    rows: list[tuple[np.ndarray, float]] = []

    def add(sigma: float, value: float, constants: np.ndarray, *poses: tuple[int, np.ndarray]):
        row = np.zeros(n + M)
        row[n:] = constants
        for k, part in poses:
            row[k * nv : (k + 1) * nv] += part
        rows.append((row / sigma, value / sigma))

    nothing, unit = np.zeros(M), np.eye(nv)
    for k in range(T):
        for i in range(nv):
            if k < 3:
                add(START_SIGMA, d.start[k, i], nothing, (k, unit[i]))
            if d.seen[k, i]:
                add(POSITION_SIGMA, d.position[k, i], nothing, (k, unit[i]))
            if k < T - 3:
                sigma = STEP**2 * np.sqrt(DENSITY[i] * STEP)
                jerk = zip((-1, 3, -3, 1), range(4), strict=True)
                add(sigma, 0.0, nothing, *((k + j, c * unit[i]) for c, j in jerk))
        if 0 < k < T - 1:
            value, columns = _force_row(d, k)
            for i in range(3):
                axis = _axes()[i] / STEP**2
                around = ((k - 1, axis), (k, -2 * axis), (k + 1, axis))
                add(FORCE_SIGMA, value[i], columns[i], *around)
    for i in range(M):
        add(CONSTANT_SIGMA[i], 0.0, np.eye(M)[i])
    Q, R = np.linalg.qr(np.array([r for r, _ in rows]))
    mean = np.linalg.solve(R, Q.T @ np.array([v for _, v in rows]))
    inverse = np.linalg.inv(R)
    covariance = inverse @ inverse.T
    blocks = covariance[:n, :n].reshape(T, nv, T, nv)[np.arange(T), :, np.arange(T)]
    return Posterior(mean[:n].reshape(T, nv), blocks, mean[n:], covariance[n:, n:])


def _smoother(d: Data) -> Posterior:
    """Kalman filter and RTS smoother with the constants as further coordinates that stay put."""
    flat, nv = vector_space(), d.body.nv
    size = nv + M
    density = jnp.concatenate([jnp.asarray(DENSITY), jnp.zeros(M)])
    h = jnp.asarray(STEP)
    dynamics = Dynamics(h, process_noise("euler", h, density))
    step = jax.jit(lambda s: predict(flat, "euler", dynamics, s))
    correct = jax.jit(lambda s, H, r, v, on: update(flat, s, H, r, v, on)[0])
    back = jax.jit(lambda s, after: smooth_step(flat, "euler", dynamics, s, after))
    filtered = [_correct(d, _first_belief(d), 0, correct)]
    for k in range(1, T):
        filtered.append(_correct(d, step(filtered[-1]), k, correct))
    smoothed = [filtered[-1]]
    for belief in filtered[-2::-1]:
        smoothed.insert(0, back(belief, smoothed[0]))
    q = np.array([s.q for s in smoothed])
    P = np.array([s.covariance[:size, :size] for s in smoothed])
    return Posterior(q[:, :nv], P[:, :nv, :nv], q[0, nv:], P[0, nv:, nv:])


def _first_belief(d: Data) -> Belief:
    """Pose, velocity and acceleration at frame 0 from the prior on the first three poses."""
    nv = d.body.nv
    size = nv + M
    from_poses = np.linalg.inv(np.array([[1, 0, 0], [1, STEP, 0], [1, 2 * STEP, STEP**2]]))
    mean = np.zeros((3, size))
    mean[:, :nv] = from_poses @ d.start
    P = np.zeros((3, size, 3, size))
    i, j = np.arange(nv), np.arange(nv, size)
    P[:, i, :, i] = START_SIGMA**2 * from_poses @ from_poses.T
    # The constants neither move nor accelerate; the gain needs a regular covariance all the same.
    for order, variance in enumerate((CONSTANT_SIGMA**2, 1e-24, 1e-26)):
        P[order, j, order, j] = variance
    return Belief(*jnp.asarray(mean), jnp.asarray(P.reshape(3 * size, 3 * size)))


def _correct(d: Data, belief: Belief, k: int, correct) -> Belief:
    """Poses measured at frame k; the accelerometer centred at k + 1, which sees a_k."""
    nv = d.body.nv
    size = nv + M
    H, z = np.zeros((nv + 3, 3 * size)), np.zeros(nv + 3)
    H[:nv, :nv], z[:nv] = np.eye(nv), d.position[k]
    on = np.concatenate([d.seen[k], np.full(3, k + 1 < T - 1)])
    if k + 1 < T - 1:
        z[nv:], H[nv:, nv:size] = _force_row(d, k + 1)
        H[nv:, 2 * size : 2 * size + nv] = _axes()
    variance = np.repeat([POSITION_SIGMA**2, FORCE_SIGMA**2], [nv, 3])
    residual = z - H @ np.concatenate(belief[:3])
    return correct(belief, H, residual, variance, on)


def _agree(a: Posterior, b: Posterior) -> None:
    np.testing.assert_allclose(a.q, b.q, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(a.constants, b.constants, rtol=1e-8, atol=1e-8)
    for ours, theirs in (
        (a.covariance, b.covariance),
        (a.constants_covariance[None], b.constants_covariance[None]),
    ):
        # Relative to the deviations: entries span many powers of ten.
        deviation = np.sqrt(np.diagonal(theirs, axis1=1, axis2=2))
        scale = deviation[:, :, None] * deviation[:, None, :]
        np.testing.assert_allclose(ours / scale, theirs / scale, atol=1e-8)


@pytest.fixture(scope="module")
def dense(data: Data) -> Posterior:
    return _dense(data)


def test_the_border_matters(dense: Posterior) -> None:
    learnt = np.sqrt(np.diag(dense.constants_covariance)) / CONSTANT_SIGMA
    seen = np.arange(3, 9)
    np.testing.assert_allclose(np.delete(learnt, seen), 1.0)
    assert learnt[seen].min() < 0.5
    assert np.abs(dense.constants[seen] / CONSTANT_SIGMA[seen]).max() > 0.1


@pytest.fixture(scope="module")
def step(data: Data) -> Posterior:
    return _gauss_newton(data, chunk=16)


@pytest.fixture(scope="module")
def smoothed(data: Data) -> Posterior:
    return _smoother(data)


def test_gauss_newton_step_is_the_dense_solution(step: Posterior, dense: Posterior) -> None:
    _agree(step, dense)


def test_smoother_is_the_dense_solution(smoothed: Posterior, dense: Posterior) -> None:
    _agree(smoothed, dense)


def test_smoother_is_the_gauss_newton_step(smoothed: Posterior, step: Posterior) -> None:
    _agree(smoothed, step)
