"""`Convention`: what the numbers of a foreign file mean, and turning them into ours."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError, unknown_name

STANDARD_GRAVITY = 9.80665
ACCELEROMETER_UNITS = {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY * 1e-3}
GYROSCOPE_UNITS = {"rad/s": 1.0, "deg/s": np.pi / 180, "mdeg/s": np.pi / 180e3, "rev/s": 2 * np.pi}
# Fields in "arbitrary units" are normalised to about 1; their scale is lost, 50 uT is usual.
MAGNETOMETER_UNITS = {
    "T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "mG": 1e-7, "a.u.": 50e-6,
}  # fmt: skip
QUATERNION_ORDERS = ("wxyz", "xyzw")
QUATERNION_DIRECTIONS = ("sensor-to-world", "world-to-sensor")
ACCELERATIONS = ("specific-force", "free-world", "free-sensor")
WORLD_UPS = {
    "z": np.eye(3),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "-z": np.diag([1.0, -1.0, -1.0]),
}
"""R_ours_file of a world frame by its axis that points up (ours is Z up)."""


@dataclass(frozen=True)
class Convention:
    """What the numbers of a file mean."""

    accelerometer_unit: str = "m/s^2"
    gyroscope_unit: str = "rad/s"
    magnetometer_unit: str = "uT"
    quaternion_order: str | None = "wxyz"
    """None where the file holds rotation matrices."""
    quaternion_direction: str = "sensor-to-world"
    """What the file's rotation maps: `sensor-to-world` is R_world_sensor."""
    gravity_sign: int = 1
    """+1: at rest the accelerometer reads +g along up (specific force); -1: along down."""
    acceleration: str = "specific-force"
    """Or gravity removed: `free-world` (in the world frame), `free-sensor` (in the sensor's)."""
    world_up: str = "z"
    """Axis of the file's world frame that points up."""
    heading: str = "unknown"
    """What the horizontal axes of the world frame point to, in words."""

    def with_overrides(self, overrides: Overrides, where: str) -> Convention:
        """The same with what the user knows better.

        Raises:
            InputError: an unknown choice, or a quaternion order where there are matrices.
        """
        given = {k: v for k, v in dataclasses.asdict(overrides).items() if v is not None}
        if "quaternion_order" in given and self.quaternion_order is None:
            raise InputError(f"{where}: holds rotation matrices; a quaternion order has no meaning")
        return dataclasses.replace(self, **given).checked(where)

    def checked(self, where: str) -> Convention:
        """The convention itself, if all its choices exist."""
        for key, valid in _CHOICES.items():
            value = getattr(self, key)
            if value not in valid and not (key == "quaternion_order" and value is None):
                what = key.replace("_", " ")
                raise InputError(f"{where}: {unknown_name(what, str(value), map(str, valid))}")
        return self

    def facts(self) -> dict[str, str | float | int | bool]:
        """For the provenance: the file's own convention, before it was turned into ours."""
        out = {f"source_{k}": v for k, v in dataclasses.asdict(self).items() if v is not None}
        out["heading"] = out.pop("source_heading")
        return out


@dataclass(frozen=True)
class Overrides:
    """What the user knows better than the format or the mapping; None keeps what they say."""

    accelerometer_unit: str | None = None
    gyroscope_unit: str | None = None
    magnetometer_unit: str | None = None
    quaternion_order: str | None = None
    quaternion_direction: str | None = None
    gravity_sign: int | None = None
    acceleration: str | None = None
    world_up: str | None = None
    heading: str | None = None


_CHOICES: dict[str, Any] = {
    "accelerometer_unit": tuple(ACCELEROMETER_UNITS),
    "gyroscope_unit": tuple(GYROSCOPE_UNITS),
    "magnetometer_unit": tuple(MAGNETOMETER_UNITS),
    "quaternion_order": QUATERNION_ORDERS,
    "quaternion_direction": QUATERNION_DIRECTIONS,
    "gravity_sign": (1, -1),
    "acceleration": ACCELERATIONS,
    "world_up": tuple(WORLD_UPS),
}


def to_orientation(
    values: Float[np.ndarray, "n 4"], convention: Convention, where: str
) -> Float[np.ndarray, "n 4"]:
    """R_world_sensor (wxyz) in our Z-up world; NaN where the file has none.

    Raises:
        InputError: quaternions that are far from unit length.
    """
    quaternion = np.asarray(values, float)
    if convention.quaternion_order == "xyzw":
        quaternion = np.roll(quaternion, 1, axis=1)
    quaternion = _normalised(quaternion, where)
    if convention.quaternion_direction == "world-to-sensor":
        quaternion = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
    if convention.world_up == "z":
        return quaternion
    good = np.isfinite(quaternion).all(axis=1)
    R_ours_file = Rotation.from_matrix(WORLD_UPS[convention.world_up])
    turned = R_ours_file * Rotation.from_quat(quaternion[good], scalar_first=True)
    out = np.full_like(quaternion, np.nan)
    out[good] = turned.as_quat(scalar_first=True)
    return out


def _normalised(quaternion: np.ndarray, where: str) -> np.ndarray:
    norm = np.linalg.norm(quaternion, axis=1)
    # Some systems write zeros where they have no orientation.
    quaternion = np.where(norm[:, None] > 1e-6, quaternion, np.nan)
    bad = np.flatnonzero(np.isfinite(norm) & (norm > 1e-6) & (np.abs(norm - 1) > 0.05))
    if bad.size:
        raise InputError(
            f"{where}: quaternion {bad[0]} has length {norm[bad[0]]:.4g}, expected 1 "
            f"({bad.size} of {len(norm)} such; are these columns a quaternion?)"
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        return quaternion / norm[:, None]


def to_specific_force(
    values: Float[np.ndarray, "n 3"],
    orientation: Float[np.ndarray, "n 4"],
    convention: Convention,
    where: str,
) -> Float[np.ndarray, "n 3"]:
    """Specific force in the sensor frame [m/s^2].

    Args:
        values: as in the file.
        orientation: ours, from `to_orientation`; turns world accelerations and gravity.
        convention: of the file.
        where: for error messages.

    Raises:
        InputError: gravity was removed, and there is no orientation to bring it back.
    """
    force = np.asarray(values, float) * ACCELEROMETER_UNITS[convention.accelerometer_unit]
    if convention.acceleration == "specific-force":
        return force * convention.gravity_sign
    good = np.isfinite(orientation).all(axis=1)
    if not good.any():
        raise InputError(
            f"{where}: gravity is removed from the accelerations ({convention.acceleration}), and "
            "without orientations it cannot be brought back"
        )
    R_world_sensor = Rotation.from_quat(orientation[good], scalar_first=True)
    up = np.array([0.0, 0.0, STANDARD_GRAVITY])
    out = np.full_like(force, np.nan)
    if convention.acceleration == "free-world":
        in_world = force[good] @ WORLD_UPS[convention.world_up].T
        out[good] = R_world_sensor.inv().apply(in_world + up)
    else:
        out[good] = force[good] + R_world_sensor.inv().apply(up)
    return out


def quaternions_of_matrices(
    matrices: Float[np.ndarray, "n 3 3"], where: str
) -> Float[np.ndarray, "n 4"]:
    """Quaternions (wxyz) of rotation matrices; NaN where a matrix is missing.

    Raises:
        InputError: matrices that are not rotations.
    """
    matrices = np.asarray(matrices, float)
    good = np.isfinite(matrices).all(axis=(1, 2))
    product = matrices[good] @ np.swapaxes(matrices[good], 1, 2)
    off = np.abs(product - np.eye(3)).max(axis=(1, 2), initial=0.0)
    if (off > 0.05).any() or (np.linalg.det(matrices[good]) < 0).any():
        first = np.flatnonzero(good)[int(np.argmax(off))]
        raise InputError(f"{where}: matrix {first} is not a rotation (R R' is {off.max():.2g} off)")
    out = np.full((len(matrices), 4), np.nan)
    out[good] = Rotation.from_matrix(matrices[good]).as_quat(scalar_first=True)
    return out
