"""Damping of jitter against a dense second-difference matrix."""

import numpy as np
import pytest

from mocap_jax.least_squares.damping import damp_jitter, jitter_force, on_the_step


@pytest.mark.parametrize(("frames", "half_bandwidth"), [(9, 2), (7, 3), (3, 2)])
def test_blocks_and_product_are_those_of_second_differences(frames, half_bandwidth):
    size, damping = 2, 5.0
    D = np.diff(np.eye(frames), 2, axis=0)
    dense = damping / 16 * np.kron(D.T @ D, np.eye(size))
    lower = np.zeros((frames, half_bandwidth + 1, size, size))
    damp_jitter(lower, damping)
    for k in range(frames):
        for o in range(min(half_bandwidth + 1, frames - k)):
            rows, columns = (slice(i * size, i * size + size) for i in (k + o, k))
            np.testing.assert_allclose(lower[k, o], dense[rows, columns], atol=1e-12)
    step = np.random.default_rng(0).standard_normal((frames, size))
    expected = (dense @ step.ravel()).reshape(frames, size)
    np.testing.assert_allclose(jitter_force(step, damping, half_bandwidth), expected, atol=1e-12)


def test_frames_may_be_damped_in_pieces():
    whole, pieces = np.zeros((2, 8, 3, 2, 2))
    damp_jitter(whole, 2.0)
    for rows in (slice(0, 3), slice(3, 8)):
        damp_jitter(pieces, 2.0, rows)
    np.testing.assert_array_equal(pieces, whole)


def test_a_smooth_step_is_hardly_damped_and_an_alternating_one_fully():
    steady, alternating = np.ones((50, 1)), (-1.0) ** np.arange(50)[:, None]
    assert np.abs(jitter_force(steady, 1.0, 2)).max() < 1e-12
    np.testing.assert_allclose(jitter_force(alternating, 1.0, 2)[2:-2], alternating[2:-2])


def test_too_short_for_second_differences_everything_is_damped():
    lower = np.zeros((2, 3, 1, 1))
    damp_jitter(lower, 1.0)
    assert not lower.any()
    assert on_the_step(3.0, 2, 2) == 3.0
    assert 0 < on_the_step(3.0, 20, 2) < 1e-3
