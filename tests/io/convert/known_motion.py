"""Sensor readings of a known motion: a rest, then turning in all directions; gravity included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

GRAVITY = 9.80665


@dataclass(frozen=True)
class Known:
    """What one sensor measures (SI, wxyz, sensor to a Z-up world)."""

    time: np.ndarray
    force: np.ndarray
    rate: np.ndarray
    orientation: np.ndarray
    field: np.ndarray
    """[T]"""

    @property
    def matrices(self) -> np.ndarray:
        return Rotation.from_quat(self.orientation, scalar_first=True).as_matrix()

    @property
    def free_world(self) -> np.ndarray:
        """Acceleration in the world, gravity removed."""
        turned = np.einsum("nij,nj->ni", self.matrices, self.force)
        return turned - [0.0, 0.0, GRAVITY]


def known(n: int = 600, rate: float = 100.0, seed: int = 0, rest: float = 1.5) -> Known:
    """Readings of `n` samples: `rest` seconds of rest, then a smooth motion of its own a seed."""
    rng = np.random.default_rng(seed)
    time = np.arange(n) / rate
    frequency, phase = rng.uniform(0.3, 1.1, (2, 3)), rng.uniform(0.5, 1.0, (2, 3))

    def turn(at: np.ndarray) -> Rotation:
        moving = np.clip(at - rest, 0.0, None)[:, None]
        return Rotation.from_rotvec(1.6 * phase[0] * np.sin(2 * np.pi * frequency[0] * moving))

    R_world_sensor = Rotation.random(random_state=seed) * turn(time)
    # The rate over each sample's interval, from half a step before to half a step after.
    before, after = turn(time - 0.5 / rate), turn(time + 0.5 / rate)
    gyroscope = (before.inv() * after).as_rotvec() * rate
    moving = np.clip(time - rest, 0.0, None)
    sway = phase[1] * np.sin(2 * np.pi * 2.0 * frequency[1] * moving[:, None])
    force = R_world_sensor.inv().apply(sway + [0.0, 0.0, GRAVITY])
    field = R_world_sensor.inv().apply(np.tile([0.0, 20e-6, -45e-6], (n, 1)))
    return Known(time, force, gyroscope, R_world_sensor.as_quat(scalar_first=True), field)


def same_rotations(a: np.ndarray, b: np.ndarray, tolerance: float = 1e-6) -> bool:
    """Whether quaternions are equal up to their sign."""
    return bool((np.abs(np.abs((a * b).sum(axis=1)) - 1) < tolerance).all())
