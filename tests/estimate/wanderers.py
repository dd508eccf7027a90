"""A small person who wanders about, with a suit of three boards, for tests of free roots."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import load_body
from mocap_jax.motion import Motion
from mocap_jax.simulation import Mounting, Suit
from mocap_jax.trajectory import Trajectory
from tests.small_arm import small_arm

_HALF = float(np.sqrt(0.5))


def wanderer(seconds: float, *, start: tuple[float, float] = (0.0, 0.0), seed: int = 0) -> Motion:
    """Somebody who sways within half a metre of where they start and moves the arm (120 Hz)."""
    body = load_body(small_arm("Pelvis", "RightUpperArm", "RightForeArm", left=False))
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / 120)
    q = np.tile(np.asarray(body.qpos0), (len(t), 1))
    fade = np.clip(t, 0, 1) ** 3 * (10 - 15 * np.clip(t, 0, 1) + 6 * np.clip(t, 0, 1) ** 2)
    wave = lambda size, f: fade * size * np.sin(2 * np.pi * f * t + rng.uniform(0, 6))  # noqa: E731
    q[:, 0], q[:, 1] = start[0] + wave(0.4, 0.13), start[1] + wave(0.4, 0.17)
    q[:, 2] += wave(0.03, 0.8)
    for first, sizes in ((3, (0.05, 0.05, 0.5)), (7, (0.5, 0.4, 0.5))):
        turn = np.stack([wave(s, rng.uniform(0.2, 0.9)) for s in sizes], axis=1)
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        q[:, first] = np.cos(angle[:, 0] / 2)
        q[:, first + 1 : first + 4] = turn * np.sinc(angle / 2 / np.pi) / 2
    q[:, 11] = 1.0 * fade + wave(0.7, 0.7)
    return Motion("wandering", body, Trajectory(t, q))


def worn(frequency: float = 40_000.0) -> Suit:
    """A board on every segment and a source on either side of the trunk."""
    return Suit(
        boards=(
            Mounting("trunk", "Pelvis", (0.11, 0.0, 0.1), (_HALF, 0.0, _HALF, 0.0)),
            Mounting("upper", "RightUpperArm", (0.15, 0.0, 0.05)),
            Mounting("lower", "RightForeArm", (0.2, 0.0, 0.04)),
        ),
        sources=(
            Mounting("left", "Pelvis", (0.0, 0.11, 0.1), (_HALF, -_HALF, 0.0, 0.0), frequency),
            Mounting("right", "Pelvis", (0.0, -0.11, 0.1), (_HALF, _HALF, 0.0, 0.0), frequency),
        ),
    )
