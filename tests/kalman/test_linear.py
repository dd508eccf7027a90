"""On linear problems the filter is the textbook one and the smoother the batch posterior."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.kalman import (
    Dynamics,
    State,
    butterworth_rate,
    predict,
    process_noise,
    smooth_pair,
    smooth_step,
    update,
    vector_space,
)

NV, FRAMES, STEP = 2, 25, 0.05
FLAT = vector_space()


def _dense(process: str, density: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """F and Q of the printed Euler form, and of white jerk by a fine numerical integral."""
    eye, o = np.eye(NV), np.zeros((NV, NV))
    h = STEP
    corner = o if process == "euler" else eye * h**2 / 2
    F = np.block([[eye, eye * h, corner], [o, eye, eye * h], [o, o, eye]])
    if process in ("paper", "euler"):
        return F, np.kron(np.diag([0, 0, 1.0]), np.diag(density * h))
    Q = np.zeros((3 * NV, 3 * NV))
    t = (np.arange(20000) + 0.5) / 20000 * h
    for s in h - t:
        g = np.array([s**2 / 2, s, 1.0])
        Q += np.kron(np.outer(g, g), np.diag(density)) * h / 20000
    return F, Q


def _problem(process: str) -> dict:
    rng = np.random.default_rng(3)
    density = np.array([2.0, 0.5])
    root = rng.normal(size=(3 * NV, 3 * NV))
    H = rng.normal(size=(FRAMES, 3, 3 * NV))
    H[:, :, 2 * NV :] *= 0.1
    F, Q = _dense(process, density)
    return dict(
        F=F, Q=Q, density=density, H=H, m0=rng.normal(size=3 * NV),
        P0=root @ root.T + np.eye(3 * NV), R=rng.uniform(0.1, 1.0, (FRAMES, 3)),
        z=rng.normal(size=(FRAMES, 3)), seen=rng.uniform(size=(FRAMES, 3)) > 0.2,
    )  # fmt: skip


def _ours(p: dict, process: str) -> tuple[list[State], list[State]]:
    noise = process_noise(process, jnp.asarray(STEP), jnp.asarray(p["density"]))
    m = jnp.asarray(p["m0"])
    state = State(m[:NV], m[NV : 2 * NV], m[2 * NV :], jnp.asarray(p["P0"]))
    dynamics, filtered = Dynamics(jnp.asarray(STEP), noise), []
    for k in range(FRAMES):
        state = state if k == 0 else predict(FLAT, process, dynamics, state)
        # Absent measurements are NaN, which must not spread.
        z = jnp.where(p["seen"][k], p["z"][k], jnp.nan)
        residual = z - p["H"][k] @ jnp.concatenate(state[:3])
        state, _ = update(FLAT, state, p["H"][k], residual, p["R"][k], jnp.asarray(p["seen"][k]))
        filtered.append(state)
    smoothed = [filtered[-1]]
    for state in filtered[-2::-1]:
        smoothed.append(smooth_step(FLAT, process, dynamics, state, smoothed[-1]))
    return filtered, smoothed[::-1]


def _textbook(p: dict) -> list[tuple[np.ndarray, np.ndarray]]:
    m, P, out = p["m0"], p["P0"], []
    for k in range(FRAMES):
        if k:
            m, P = p["F"] @ m, p["F"] @ P @ p["F"].T + p["Q"]
        rows = p["seen"][k]
        H, R = p["H"][k][rows], np.diag(p["R"][k][rows])
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        m, P = m + K @ (p["z"][k][rows] - H @ m), (np.eye(3 * NV) - K @ H) @ P
        out.append((m, P))
    return out


def test_the_smoothed_mean_needs_no_smoothed_covariances() -> None:
    p = _problem("white_jerk")
    filtered, smoothed = _ours(p, "white_jerk")
    noise = process_noise("white_jerk", jnp.asarray(STEP), jnp.asarray(p["density"]))
    dynamics, following = Dynamics(jnp.asarray(STEP), noise), filtered[-1]
    for here, expected in zip(filtered[-2::-1], smoothed[-2::-1], strict=True):
        following = smooth_step(FLAT, "white_jerk", dynamics, here, following, covariance=False)
        for ours, theirs in zip(following[:3], expected[:3], strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-9)
        np.testing.assert_array_equal(following.covariance, here.covariance)


@pytest.mark.parametrize("process", ["white_jerk", "paper", "euler"])
def test_filter_is_the_textbook_one(process: str) -> None:
    p = _problem(process)
    for ours, (m, P) in zip(_ours(p, process)[0], _textbook(p), strict=True):
        # The textbook's Q of white jerk is a numerical integral.
        tolerance = 1e-7 if process == "white_jerk" else 1e-10
        np.testing.assert_allclose(jnp.concatenate(ours[:3]), m, atol=tolerance)
        np.testing.assert_allclose(ours.covariance, P, atol=tolerance)


@pytest.mark.parametrize("process", ["euler", "white_jerk"])
def test_smoother_is_the_batch_posterior(process: str) -> None:
    p = _problem(process)
    n = 3 * NV
    # Unknowns: the first state and all process noises; every state is linear in them.
    maps = [np.hstack([np.eye(n), np.zeros((n, n * (FRAMES - 1)))])]
    for k in range(1, FRAMES):
        new = p["F"] @ maps[-1]
        new[:, n * k : n * (k + 1)] += np.eye(n)
        maps.append(new)
    covariance = np.kron(np.eye(FRAMES), p["Q"])
    covariance[:n, :n] = p["P0"]
    mean = np.concatenate([p["m0"], np.zeros(n * (FRAMES - 1))])
    rows = [(k, i) for k in range(FRAMES) for i in range(3) if p["seen"][k, i]]
    H = np.array([p["H"][k, i] @ maps[k] for k, i in rows])
    R = np.diag([p["R"][k, i] for k, i in rows])
    z = np.array([p["z"][k, i] for k, i in rows])
    K = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + R)
    mean, covariance = mean + K @ (z - H @ mean), covariance - K @ H @ covariance
    tolerance = 1e-6 if process == "white_jerk" else 1e-8
    filtered, smoothed = _ours(p, process)
    for ours, A in zip(smoothed, maps, strict=True):
        np.testing.assert_allclose(jnp.concatenate(ours[:3]), A @ mean, atol=tolerance)
        np.testing.assert_allclose(ours.covariance, A @ covariance @ A.T, atol=tolerance)
    noise = process_noise(process, jnp.asarray(STEP), jnp.asarray(p["density"]))
    dynamics = Dynamics(jnp.asarray(STEP), noise)
    for k, (here, following) in enumerate(zip(filtered, smoothed[1:], strict=False)):
        _, pair = smooth_pair(FLAT, process, dynamics, here, following)
        expected = (maps[k + 1] @ covariance @ maps[k].T)[:NV, :NV]
        np.testing.assert_allclose(pair, expected, atol=tolerance)


def test_gate_limits_an_outlier_and_leaves_the_rest() -> None:
    state = State(jnp.zeros(1), jnp.zeros(1), jnp.zeros(1), jnp.eye(3))
    H, variance = jnp.array([[1.0, 0, 0]]), jnp.array([0.1])
    used = jnp.array([True])
    pull = lambda r, gate: update(  # noqa: E731
        FLAT, state, H, jnp.array([r]), variance, used, gate
    )[0].q[0]
    assert pull(2.0, 4.0) == pull(2.0, 0.0)
    assert 0 < pull(50.0, 4.0) < 0.05 * pull(50.0, 0.0)


def test_an_update_that_is_not_finite_is_skipped() -> None:
    state = State(jnp.zeros(1), jnp.zeros(1), jnp.zeros(1), jnp.eye(3))
    H, one = jnp.array([[jnp.inf, 0, 0]]), jnp.array([1.0])
    after, innovation = update(FLAT, state, H, one, one, jnp.array([True]))
    assert not innovation.accepted
    np.testing.assert_array_equal(after.covariance, state.covariance)


def test_pull_gives_the_stated_deviation() -> None:
    density, sigma, h = jnp.array([50.0]), jnp.array([0.4]), jnp.asarray(0.005)
    noise = process_noise("white_jerk", h, density)
    dynamics = Dynamics(h, noise, butterworth_rate(density, sigma), jnp.array([1.0]))
    state = State(jnp.zeros(1), jnp.zeros(1), jnp.zeros(1), 1e-6 * jnp.eye(3))
    step = jax.jit(lambda s: predict(FLAT, "white_jerk", dynamics, s))
    for _ in range(2000):
        state = step(state)
    np.testing.assert_allclose(jnp.sqrt(state.covariance[0, 0]), sigma[0], rtol=0.05)
    np.testing.assert_allclose(state.q, 1.0, atol=1e-6)
