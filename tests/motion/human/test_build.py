"""The human body: size, mass, names, symmetry and the sense of its joints."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion import XSENS_SEGMENTS, human
from mocap_jax.motion.human import Sex


def posed(body: Body, **degrees: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    for joint, angle in degrees.items():
        data.joint(joint).qpos[0] = np.radians(angle)
    mujoco.mj_kinematics(model, data)
    return model, data


@pytest.mark.parametrize("sex", ["female", "male", None])
@pytest.mark.parametrize(("height", "mass"), [(1.75, 70.0), (1.55, 50.0), (1.95, 110.0)])
def test_size_and_mass_are_as_asked(height: float, mass: float, sex: Sex | None) -> None:
    model, data = posed(human(height, mass, sex))
    reach = model.geom_size[:, 0] + model.geom_size[:, 1] * np.abs(data.geom_xmat[:, 8])
    assert model.body_mass.sum() == pytest.approx(mass, rel=1e-14)
    assert (data.geom_xpos[:, 2] - reach).min() == pytest.approx(0.0, abs=1e-9)
    assert (data.geom_xpos[:, 2] + reach).max() == pytest.approx(height, abs=1e-9)


def breadth(body: Body, *segments: str) -> float:
    """Overall breadth [m] of some segments in the zero pose."""
    model, data = posed(body)
    own = np.isin(model.geom_bodyid, [model.body(s).id for s in segments])
    across = np.abs(data.geom_xpos[own, 1])
    across += model.geom_size[own, 0] + model.geom_size[own, 1] * np.abs(data.geom_xmat[own, 7])
    return 2 * float(across.max())


def test_sexes_differ_in_shoulders_waist_and_hips_and_none_is_between() -> None:
    bodies = [human(sex=sex) for sex in ("female", None, "male")]
    shoulders, waist, hips = (
        [breadth(b, *segments) for b in bodies]
        for segments in (("LeftUpperArm", "RightUpperArm"), ("L3",), ("Pelvis",))
    )
    assert shoulders == sorted(shoulders) and shoulders[0] < 0.95 * shoulders[2]
    assert waist == sorted(waist)
    assert hips == sorted(hips, reverse=True)
    assert 0.70 < waist[0] / hips[0] < waist[2] / hips[2] < 0.95


def test_heavier_is_thicker_but_not_taller() -> None:
    light, heavy = human(mass=60.0), human(mass=90.0)
    assert breadth(heavy, "L3") / breadth(light, "L3") == pytest.approx(np.sqrt(1.5), rel=1e-9)
    np.testing.assert_allclose(heavy.body_pos, light.body_pos, atol=1e-12)


def test_segments_are_the_23_of_xsens() -> None:
    body = human()
    assert set(body.topology.body_names[1:]) == set(XSENS_SEGMENTS)
    assert body.nv == 56
    assert body.topology.joint_names[0] == "root"


def test_zero_pose_frames_are_parallel_and_the_body_symmetric() -> None:
    model, data = posed(human())
    np.testing.assert_allclose(data.xmat[1:], np.tile(np.eye(3).ravel(), (23, 1)), atol=1e-12)
    for name in XSENS_SEGMENTS:
        if name.startswith("Left"):
            other = data.body(name.replace("Left", "Right")).xpos
            np.testing.assert_allclose(data.body(name).xpos, other * [1, -1, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("motion", "tip", "direction"),
    [
        ("ForeArm_flexion", "Hand", (1, 0, 0)),
        ("LowerLeg_flexion", "Foot", (-1, 0, 0)),
        ("Foot_dorsiflexion", "Toe", (0, 0, 1)),
        ("Shoulder_protraction", "UpperArm", (1, 0, 0)),
        ("Shoulder_elevation", "UpperArm", (0, 0, 1)),
    ],
)
@pytest.mark.parametrize("side", ["Left", "Right"])
def test_hinges_turn_as_named(
    side: str, motion: str, tip: str, direction: tuple[float, float, float]
) -> None:
    body = human()
    _, rest = posed(body)
    before = rest.body(side + tip).xpos.copy()
    _, moved = posed(body, **{f"{side}{motion}": 10.0})
    assert np.dot(moved.body(side + tip).xpos - before, direction) > 0.01


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_palm_and_sole_turn_as_named(side: str) -> None:
    inward = -1.0 if side == "Left" else 1.0
    _, data = posed(human(), **{f"{side}Hand_flexion": 30.0})
    assert -data.body(f"{side}Hand").xmat.reshape(3, 3)[1, 2] * inward > 0.4  # fingers inward
    _, data = posed(human(), **{f"{side}Foot_inversion": 20.0})
    assert data.body(f"{side}Foot").xmat.reshape(3, 3)[2, 1] * inward > 0.3  # inner edge up
    _, data = posed(human(), **{f"{side}ForeArm_pronation": 80.0})
    assert inward * data.body(f"{side}Hand").xmat.reshape(3, 3)[0, 1] < -0.9  # palm backward


def test_wrong_sizes_are_refused() -> None:
    with pytest.raises(InputError, match="height must be 0.5 to 2.5 m, got 175"):
        human(height=175)
    with pytest.raises(InputError, match="mass must be"):
        human(mass=-1.0)
    with pytest.raises(InputError, match="unknown sex 'woman'; valid: female, male, None"):
        human(sex="woman")
