"""Patches: points lie on the surface of the segment's shapes, inside the patch, smoothly."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion import human
from mocap_jax.placement.surface import HEIGHT, Surfaces, board_point, outward_at, patches_of


@pytest.fixture(scope="module")
def body() -> Body:
    return human()


def test_points_are_a_board_s_height_over_the_outermost_shape(body: Body):
    """Against C MuJoCo's rays, from outside towards the axis."""
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    rng = np.random.default_rng(0)
    for patch in patches_of(body):
        for share in rng.uniform(size=(5, 2)):
            low, high = np.array([patch.along, patch.around]).T
            place = low + share * (high - low)
            point = np.asarray(board_point(patch, jnp.asarray(place)))
            outward = np.asarray(outward_at(patch, jnp.asarray(place)))
            R, p = data.xmat[patch.body].reshape(3, 3), data.xpos[patch.body]
            start, nearest = p + R @ (point + outward), np.inf
            for geom in np.flatnonzero(model.geom_bodyid == patch.body):
                hit = mujoco.mju_rayGeom(
                    data.geom_xpos[geom], data.geom_xmat[geom], model.geom_size[geom], start,
                    -(R @ outward), model.geom_type[geom],
                )  # fmt: skip
                nearest = hit if 0 <= hit < nearest else nearest
            assert nearest == pytest.approx(1.0 + HEIGHT, abs=1e-6), patch.segment


def test_places_stay_inside_their_patches(body: Body):
    surfaces = Surfaces(patches_of(body)[:4])
    for value in (-50.0, 0.0, 50.0):
        places = np.asarray(surfaces.places(jnp.full((4, 2), value)))
        for patch, (along, around) in zip(surfaces.patches, places, strict=True):
            assert patch.along[0] <= along <= patch.along[1]
            assert patch.around[0] <= around <= patch.around[1]
    free = np.random.default_rng(0).normal(size=(4, 2))
    np.testing.assert_allclose(surfaces.free(np.asarray(surfaces.places(free))), free, atol=1e-9)


def test_points_can_be_differentiated(body: Body):
    surfaces = Surfaces(patches_of(body, ("LeftForeArm", "Head", "Pelvis")))
    point = lambda f: surfaces.points(surfaces.places(f))  # noqa: E731
    free = jnp.asarray(np.random.default_rng(1).normal(size=(3, 2)))
    slope = jax.jacfwd(point)(free)
    for i in range(3):
        for j in range(2):
            step = 1e-6 * jnp.zeros((3, 2)).at[i, j].set(1.0)
            difference = (point(free + step) - point(free - step)) / 2e-6
            np.testing.assert_allclose(slope[:, :, i, j], difference, atol=1e-6)


def test_left_and_right_mirror(body: Body):
    found = {p.segment: p for p in patches_of(body)}
    for part in ("UpperArm", "ForeArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "Shoulder"):
        left, right = found["Left" + part], found["Right" + part]
        place = jnp.array([0.4, 1.0])
        mirrored = np.asarray(board_point(right, place)) * [1, -1, 1]
        np.testing.assert_allclose(board_point(left, place), mirrored, atol=1e-6)


def test_unknown_segments_are_named(body: Body):
    with pytest.raises(InputError, match="'Tail'.*LeftForeArm"):
        patches_of(body, ("Tail",))
