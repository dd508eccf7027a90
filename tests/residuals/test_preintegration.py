"""Preintegrated samples: a closed-form motion, and derivatives beside central differences."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax import so3
from mocap_jax.residuals.preintegration import (
    Increment,
    Knot,
    Samples,
    increment_slopes,
    interval_residual,
    moved,
    preintegrate,
    residual_slopes,
    retract,
)

GRAVITY = np.array([0.0, 0.0, -9.81])


def random_samples(seed: int = 0, n: int = 40) -> Samples:
    generator = np.random.default_rng(seed)
    rate, force = generator.normal(size=(2, n + 1, 3)) * np.array([2.0, 8.0])[:, None, None]
    return Samples(rate, force, np.full(n, 0.01))


def coning_error(step: float) -> float:
    """Angle after one second of exact means of a coning motion's rates [rad]."""
    # R = exp(skew(a (cos, sin, 0))) has a rate whose mean over a step is had from dense sampling.
    fine, n = 50, round(1 / step)
    t = np.arange(-fine, n * fine + 1) * step / fine
    angle = 0.3 * np.stack([np.cos(12 * t), np.sin(12 * t), 0 * t], axis=1)
    R = np.asarray(so3.exp(angle))
    turned = np.asarray(jax.vmap(so3.log)(so3.matmul3(np.swapaxes(R[:-1], 1, 2), R[1:])))
    means = turned.reshape(-1, fine, 3).sum(axis=1) / step
    samples = Samples(means, np.zeros_like(means), np.full(n, step))
    increment, _ = preintegrate(samples, jnp.zeros(3), jnp.zeros(15))
    truth = R[fine].T @ R[-1]
    return float(np.linalg.norm(so3.log(truth.T @ np.asarray(increment.rotation))))


def test_coning_is_followed_to_high_order() -> None:
    coarse, fine = coning_error(0.02), coning_error(0.01)
    assert fine < 2e-5 and coarse / fine > 8  # without the cross product: order two, 1e-3


def test_bias_and_scale_are_taken_off() -> None:
    true = random_samples()
    bias, constants = jnp.array([0.1, -0.2, 0.05]), jnp.zeros(15)
    measured = true._replace(rate=true.rate + bias)
    for a, b in zip(
        preintegrate(measured, bias, constants)[0],
        preintegrate(true, 0 * bias, constants)[0],
        strict=True,
    ):
        np.testing.assert_allclose(a, b, atol=1e-12)


def test_padding_adds_nothing() -> None:
    samples = random_samples()
    short = Samples(samples.rate[:31], samples.force[:31], samples.step[:30])
    padded = samples._replace(step=np.where(np.arange(40) < 30, samples.step, 0.0))
    a, _ = preintegrate(short, jnp.zeros(3), jnp.zeros(15))
    b, _ = preintegrate(padded, jnp.zeros(3), jnp.zeros(15))
    np.testing.assert_allclose(a.rotation, b.rotation, atol=1e-14)
    np.testing.assert_allclose(a.position, b.position, atol=1e-14)


def test_slopes_of_the_increment() -> None:
    samples, x = random_samples(), np.random.default_rng(1).normal(size=18) * 0.02
    increment, slopes = increment_slopes(samples, x[:3], x[3:])

    def difference(x: np.ndarray) -> np.ndarray:
        other, _ = preintegrate(samples, x[:3], x[3:])
        turned = so3.log(increment.rotation.T @ other.rotation)
        return np.concatenate([turned, other.velocity, other.position])

    e = 1e-6 * np.eye(18)
    numeric = np.stack([(difference(x + d) - difference(x - d)) / 2e-6 for d in e], axis=1)
    np.testing.assert_allclose(slopes, numeric, atol=1e-7)


def test_slopes_of_the_residual() -> None:
    generator = np.random.default_rng(2)
    first, second = (
        Knot(np.asarray(so3.exp(generator.normal(size=3))), *generator.normal(size=(2, 3)))
        for _ in range(2)
    )
    increment = Increment(*preintegrate(random_samples(), jnp.zeros(3), jnp.zeros(15))[0])
    _, slopes = residual_slopes(first, second, increment, GRAVITY, jnp.array(0.4))

    def value(x: np.ndarray) -> np.ndarray:
        return np.asarray(
            interval_residual(
                retract(first, x[:9]), retract(second, x[9:18]), moved(increment, x[18:]),
                GRAVITY, jnp.array(0.4),
            )
        )  # fmt: skip

    e = 1e-6 * np.eye(27)
    numeric = np.stack([(value(d) - value(-d)) / 2e-6 for d in e], axis=1)
    np.testing.assert_allclose(slopes, numeric, atol=1e-7)


def test_a_free_fall_leaves_no_residual() -> None:
    samples = Samples(np.zeros((41, 3)), np.zeros((41, 3)), np.full(40, 0.01))
    increment, _ = preintegrate(samples, jnp.zeros(3), jnp.zeros(15))
    T, v = 0.4, np.array([1.0, 0.0, 2.0])
    first = Knot(np.eye(3), v, np.zeros(3))
    second = Knot(np.eye(3), v + T * GRAVITY, T * v + T**2 / 2 * GRAVITY)
    np.testing.assert_allclose(
        interval_residual(first, second, increment, GRAVITY, jnp.array(T)), 0, atol=1e-12
    )
