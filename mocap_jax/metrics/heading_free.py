"""Orientation error of a sensor whose heading has no zero: one constant offset is free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mocap_jax import so3


class HeadingFreeError(NamedTuple):
    """Errors of each sample [rad], with the one heading offset that makes the total least."""

    total: Float[np.ndarray, "n"]
    """Angle between estimate and reference."""
    heading: Float[np.ndarray, "n"]
    """About the vertical, signed."""
    inclination: Float[np.ndarray, "n"]
    """Angle of the rest of the rotation, about a horizontal axis."""
    offset: float
    """Heading offset taken off [rad]."""


def heading_free_error(
    estimate: Float[np.ndarray, "n 4"], reference: Float[np.ndarray, "n 4"]
) -> HeadingFreeError:
    """Error between two orientations R_world_sensor (wxyz) of a world with Z up.

    The world-frame error is split into a turn about the vertical after one about a horizontal axis;
    NaN where the reference is.
    """
    from scipy.optimize import minimize_scalar  # slow to import, and seldom needed

    error = np.asarray(so3.quat_multiply(estimate, so3.quat_conjugate(reference)))
    known = np.isfinite(error).all(axis=1)
    upright = np.hypot(error[:, 0], error[:, 3])
    turn = 2 * np.arctan2(error[:, 3], error[:, 0])

    def total(offset: float) -> np.ndarray:
        cosine = np.abs(upright * np.cos((turn - offset) / 2))
        return 2 * np.arccos(np.clip(cosine, 0, 1))

    guess = float(np.angle(np.exp(1j * turn[known]).mean()))
    squares = lambda offset: float((total(offset)[known] ** 2).sum())  # noqa: E731
    offset = float(minimize_scalar(squares, bounds=(guess - 0.5, guess + 0.5)).x)
    heading = np.angle(np.exp(1j * (turn - offset)))
    return HeadingFreeError(total(offset), heading, 2 * np.arccos(np.clip(upright, 0, 1)), offset)
