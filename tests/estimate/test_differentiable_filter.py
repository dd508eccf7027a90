"""Derivatives of the filter against differences of runs."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.estimate import EkfOptions, ekf
from mocap_jax.estimate.derivatives import (
    DifferentiableFilter,
    FilterParameters,
    differentiable_ekf,
)
from mocap_jax.recording import Recording
from tests.estimate.synthetic import record, small_body

OPTIONS = EkfOptions(chunk=32)


@pytest.fixture(scope="module")
def recording() -> Recording:
    recording = record(seconds=2.5)
    board = recording.inertial["forearm"]
    rate = np.array(board.gyroscope)
    rate[200:205] = np.nan
    holed = dataclasses.replace(board, gyroscope=rate)
    return dataclasses.replace(recording, inertial=recording.inertial | {"forearm": holed})


@pytest.fixture(scope="module")
def filtered(recording: Recording) -> DifferentiableFilter:
    return differentiable_ekf(recording, options=OPTIONS)


def test_it_is_the_filter(recording: Recording, filtered: DifferentiableFilter) -> None:
    plain = ekf(recording, options=OPTIONS)
    found = filtered(filtered.parameters)
    np.testing.assert_allclose(found.q, plain.trajectory.q, atol=1e-10)
    np.testing.assert_allclose(found.covariance, plain.covariance, rtol=1e-7, atol=1e-12)


def test_recordings_without_distances(recording: Recording) -> None:
    options = EkfOptions(kinds="AG", chunk=32)
    found = differentiable_ekf(recording, options=options)
    plain = ekf(recording, options=options)
    np.testing.assert_allclose(found(found.parameters).q, plain.trajectory.q, atol=1e-10)


@pytest.mark.slow
def test_gradients_are_those_of_differences(filtered: DifferentiableFilter) -> None:
    base = filtered.parameters
    weights = np.random.default_rng(0).normal(size=filtered(base).q.shape)

    def value(p: FilterParameters) -> jax.Array:
        found = filtered(p)
        return (weights * found.q).sum() + 1e-3 * found.log_likelihood

    value = jax.jit(value)
    gradient = jax.grad(value)(base)
    slopes = {jax.tree_util.keystr(k): x for k, x in jax.tree.leaves_with_path(gradient)}
    rng, checked = np.random.default_rng(1), 0
    for path, start in jax.tree.leaves_with_path(base):
        name = jax.tree_util.keystr(path)
        known = np.isfinite(start)
        # The covariance must stay symmetric; quantities of the rest hold's process must agree.
        if not known.any() or "covariance" in name or "dynamics" in name or "range" in name:
            continue
        direction = np.where(known, rng.normal(size=np.shape(start)), 0.0)
        direction *= np.abs(np.where(known, start, 0.0)).max() or 1.0

        def at(h: float, name: str = name, direction: np.ndarray = direction) -> float:
            moved = jax.tree_util.tree_map_with_path(
                lambda k, x: x + h * direction if jax.tree_util.keystr(k) == name else x, base
            )
            return float(value(moved))

        h = 1e-5
        expected = (at(-2 * h) - 8 * at(-h) + 8 * at(h) - at(2 * h)) / (12 * h)
        got = float(jnp.where(known, slopes[name] * direction, 0.0).sum())
        assert got == pytest.approx(expected, rel=1e-4, abs=1e-6), name
        checked += abs(expected) > 1e-6
    assert checked >= 10


@pytest.mark.slow
def test_gradients_with_joint_limits_are_those_of_differences() -> None:
    """The elbow moves beyond its range, so that beliefs are cut off."""
    body = small_body()
    elbow = body.topology.joint_index("elbow")
    narrow = body.replace(joint_range=body.joint_range.at[elbow].set(jnp.array([-0.05, 0.08])))
    recording = record(seconds=2.0, rate_hz=70.0)
    options = EkfOptions(kinds="AG", limits=True, chunk=70)
    filtered = differentiable_ekf(recording, narrow, options=options)
    base, rng = filtered.parameters, np.random.default_rng(0)
    push = rng.normal(size=base.measurements.accelerometer.shape)
    weights = rng.normal(size=(len(push), body.nq))

    @jax.jit
    @jax.value_and_grad
    def value(change: jax.Array) -> jax.Array:
        """Of the gyroscopes' deviation (log), of readings [m/s^2] and of the range [rad]."""
        noise = base.noise._replace(gyroscope_sigma=base.noise.gyroscope_sigma * jnp.exp(change[0]))
        force = base.measurements.accelerometer + change[1] * push
        measurements = dataclasses.replace(base.measurements, accelerometer=force)
        ranges = base.body.joint_range.at[elbow].add(change[2])
        moved = dataclasses.replace(base.body, joint_range=ranges)
        found = filtered(
            dataclasses.replace(base, noise=noise, measurements=measurements, body=moved)
        )
        return (weights * found.q).sum() + 1e-3 * found.log_likelihood

    gradient = value(jnp.zeros(3))[1]
    for i in range(3):
        at = lambda h, i=i: float(value(jnp.zeros(3).at[i].set(h))[0])  # noqa: E731
        h = 1e-4
        expected = (at(-2 * h) - 8 * at(-h) + 8 * at(h) - at(2 * h)) / (12 * h)
        assert abs(expected) > 1e-3, i
        # JAX's logarithm of a normal's far tail is a short series, whose derivative differs.
        assert float(gradient[i]) == pytest.approx(expected, rel=1e-4), i


def test_a_smoother_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match="smooth=False"):
        differentiable_ekf(recording, options=EkfOptions(smooth=True))


@pytest.mark.slow
def test_noise_figures_are_found_by_climbing_the_likelihood() -> None:
    """Readings with three times the declared noise: the likelihood leads there."""
    optax = pytest.importorskip("optax")
    recording = record(seconds=4.0, rate_hz=70.0, noise=3.0)
    filtered = differentiable_ekf(recording, options=OPTIONS)
    base = filtered.parameters

    @jax.jit
    @jax.value_and_grad
    def cost(log_factor: jax.Array) -> jax.Array:
        gyroscope, accelerometer = jnp.exp(log_factor)
        noise = base.noise._replace(
            gyroscope_sigma=base.noise.gyroscope_sigma * gyroscope,
            accelerometer_sigma=base.noise.accelerometer_sigma * accelerometer,
        )
        return -filtered(dataclasses.replace(base, noise=noise)).log_likelihood

    descent, log_factor = optax.adam(0.1), jnp.zeros(2)
    state = descent.init(log_factor)
    for _ in range(60):
        _, slope = cost(log_factor)
        change, state = descent.update(slope, state)
        log_factor = optax.apply_updates(log_factor, change)
    # The filter's first-order treatment of motion adds its share to the noise.
    np.testing.assert_allclose(np.exp(log_factor), 3.0, rtol=0.2)
