"""Orientation error with one constant heading offset free."""

from __future__ import annotations

import numpy as np

from mocap_jax import so3
from mocap_jax.metrics import heading_free_error


def test_an_offset_of_heading_is_no_error() -> None:
    reference = np.asarray(so3.quat_exp(np.random.default_rng(0).normal(size=(50, 3))))
    turned = so3.quat_multiply(so3.quat_exp(np.array([0, 0, 2.5])), reference)
    error = heading_free_error(np.asarray(turned), reference)
    assert abs(error.total).max() < 1e-5
    np.testing.assert_allclose(error.offset, 2.5, atol=1e-6)


def test_parts_of_the_error() -> None:
    """A drift of heading over a constant tilt, both known."""
    generator = np.random.default_rng(1)
    reference = np.array(so3.quat_exp(generator.normal(size=(101, 3))))
    reference[7] = np.nan
    drift = np.linspace(-0.05, 0.05, 101)
    turn = so3.quat_exp(np.stack([0 * drift, 0 * drift, drift], axis=1))
    tilt = so3.quat_exp(np.array([0.03, 0.0, 0.0]))
    error = heading_free_error(
        np.asarray(so3.quat_multiply(so3.quat_multiply(turn, tilt), reference)), reference
    )
    known = np.arange(101) != 7
    np.testing.assert_allclose(error.inclination[known], 0.03, atol=1e-6)
    np.testing.assert_allclose(error.heading[known], drift[known], atol=2e-3)
    np.testing.assert_allclose(error.total[known] ** 2, 0.03**2 + drift[known] ** 2, atol=2e-4)
    assert np.isnan(error.total[7])
