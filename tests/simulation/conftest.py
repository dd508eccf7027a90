"""A small body that moves smoothly, with a suit of three boards and two sources."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.body import load_body
from mocap_jax.motion import Motion
from mocap_jax.simulation import Mounting, Suit
from mocap_jax.trajectory import Trajectory
from tests.small_arm import small_arm


@pytest.fixture(scope="session")
def suit() -> Suit:
    half = float(np.sqrt(0.5))
    return Suit(
        boards=(
            Mounting("base", "base", (0.0, -0.11, 0.1), (half, half, 0.0, 0.0)),
            Mounting("upper", "upper", (0.15, 0.03, 0.05), (0.9, 0.1, -0.3, 0.3)),
            Mounting("lower", "lower", (0.2, 0.0, 0.04), (0.8, -0.2, 0.5, 0.1)),
        ),
        sources=(
            Mounting("front", "base", (0.12, 0.0, 0.0), (half, 0.0, half, 0.0)),
            Mounting("back", "base", (-0.12, 0.0, 0.1), (half, 0.0, -half, 0.0)),
        ),
    )


@pytest.fixture(scope="session")
def motion() -> Motion:
    """Four seconds at 120 Hz with content up to 2 Hz in every coordinate."""
    body = load_body(small_arm("base", "upper", "lower", left=True))
    t = np.arange(0, 4, 1 / 120)
    q = np.zeros((len(t), body.nq))
    wave = lambda a, f, p: a * np.sin(2 * np.pi * f * t + p)  # noqa: E731
    q[:, 0], q[:, 1] = 0.5 * t, wave(0.1, 0.7, 0)
    q[:, 2] = 1.2 + wave(0.05, 1.6, 1)
    for first, sizes in ((3, (0.3, 0.2, 0.9)), (7, (0.8, 0.5, 0.6))):
        angle = np.stack([wave(a, 0.4 + 0.5 * i, i) for i, a in enumerate(sizes)], axis=1)
        size = np.linalg.norm(angle, axis=1, keepdims=True)
        q[:, first] = np.cos(size[:, 0] / 2)
        q[:, first + 1 : first + 4] = np.sin(size / 2) * angle / size
    q[:, 11] = 1.0 + wave(0.9, 1.3, 0.5)
    return Motion("waves", body, Trajectory(t, q))
