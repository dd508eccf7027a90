"""Units, quaternion order and direction, worlds and removed gravity come out as ours."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from known_motion import GRAVITY, known, same_rotations
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError
from mocap_jax.io.convert.convention import (
    WORLD_UPS,
    Convention,
    Overrides,
    quaternions_of_matrices,
    to_orientation,
    to_specific_force,
)

CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


@pytest.mark.parametrize(
    "order, direction, up",
    list(itertools.product(["wxyz", "xyzw"], ["sensor-to-world", "world-to-sensor"], WORLD_UPS)),
)
def test_orientations_of_every_convention_come_out_alike(order, direction, up):
    motion = known(40)
    R_file_ours = Rotation.from_matrix(WORLD_UPS[up]).inv()
    file = R_file_ours * Rotation.from_quat(motion.orientation, scalar_first=True)
    values = file.as_quat(scalar_first=True)
    if direction == "world-to-sensor":
        values = values * CONJUGATE
    if order == "xyzw":
        values = np.roll(values, -1, axis=1)
    convention = Convention(quaternion_order=order, quaternion_direction=direction, world_up=up)
    assert same_rotations(to_orientation(values, convention, "x"), motion.orientation)


def test_up_of_every_world_becomes_z():
    for name, up in (("z", [0, 0, 1]), ("y", [0, 1, 0]), ("x", [1, 0, 0]), ("-z", [0, 0, -1])):
        turn = WORLD_UPS[name]
        np.testing.assert_allclose(turn @ up, [0, 0, 1])
        assert np.linalg.det(turn) == pytest.approx(1.0), "a rotation, no mirror"


@pytest.mark.parametrize("unit, size", [("m/s^2", 1.0), ("g", GRAVITY), ("mg", GRAVITY / 1000)])
def test_accelerations_of_every_unit_and_sign(unit, size):
    motion = known(40)
    convention = Convention(accelerometer_unit=unit, gravity_sign=-1)
    force = to_specific_force(-motion.force / size, motion.orientation, convention, "x")
    np.testing.assert_allclose(force, motion.force, atol=1e-12)


@pytest.mark.parametrize("up", WORLD_UPS)
def test_removed_gravity_comes_back(up):
    motion = known(40)
    world = motion.free_world @ WORLD_UPS[up]  # ours to the file's
    convention = Convention(acceleration="free-world", world_up=up)
    force = to_specific_force(world, motion.orientation, convention, "x")
    np.testing.assert_allclose(force, motion.force, atol=1e-9)
    inverse = Rotation.from_quat(motion.orientation, scalar_first=True).inv()
    convention = Convention(acceleration="free-sensor")
    free = inverse.apply(motion.free_world)
    force = to_specific_force(free, motion.orientation, convention, "x")
    np.testing.assert_allclose(force, motion.force, atol=1e-9)


def test_removed_gravity_needs_orientations():
    with pytest.raises(InputError, match="without orientations it cannot be brought back"):
        missing = np.full((40, 4), np.nan)
        to_specific_force(known(40).force, missing, Convention(acceleration="free-world"), "x")


def test_missing_orientations_stay_missing():
    values = known(40).orientation
    values[3], values[5] = np.nan, 0.0
    for up in ("z", "y"):
        out = to_orientation(values, Convention(world_up=up), "x")
        assert np.isnan(out[[3, 5]]).all() and np.isfinite(np.delete(out, [3, 5], 0)).all()


def test_columns_that_are_no_quaternions_are_refused():
    with pytest.raises(InputError, match="quaternion 0 has length 2, expected 1"):
        to_orientation(2 * known(40).orientation, Convention(), "file")
    with pytest.raises(InputError, match="is not a rotation"):
        quaternions_of_matrices(2 * known(40).matrices, "file")


def test_overrides_name_valid_choices():
    with pytest.raises(InputError, match="unknown gyroscope unit 'dps'; valid: rad/s, deg/s"):
        Convention().with_overrides(Overrides(gyroscope_unit="dps"), "file")
    with pytest.raises(InputError, match="rotation matrices"):
        Convention(quaternion_order=None).with_overrides(Overrides(quaternion_order="xyzw"), "f")
