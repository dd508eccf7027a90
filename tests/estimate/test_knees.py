"""Ball joints at knees are held near a hinge; other bodies are left alone."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic import record

import mocap_jax as mj
from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.estimate.sequence.knees import knee_hinges

LEG = """<body name="{side}UpperLeg" pos="{x} 0 -.1"><joint type="ball"/><geom size=".05"/>
<body name="{side}LowerLeg" pos="{splay} 0 -.4"><joint name="{side}Knee" {knee}/><geom size=".05"/>
<body name="{side}Foot" pos="{splay} 0 -.4"><joint type="ball"/><geom size=".05"/></body>
</body></body>"""
OPTIONS = mj.OptimiseOptions()


def legs(knee: str = 'type="ball"', foot: str = "Foot") -> Body:
    """Legs that are splayed by a quarter of their length; right is -x."""
    sides = {"Right": -1, "Left": 1}
    both = "".join(
        LEG.format(side=side, x=0.1 * s, splay=0.1 * s, knee=knee).replace("Foot", foot)
        for side, s in sides.items()
    )
    return load_body(
        f'<mujoco><worldbody><body name="Pelvis"><freejoint/><geom size=".1"/>{both}'
        '<body name="Head" pos="0 0 .6"><joint type="ball"/><geom size=".1"/></body>'
        "</body></worldbody></mujoco>"
    )


def values(body: Body, turn: dict[str, np.ndarray]) -> np.ndarray:
    """Whitened residuals with joints turned from the reference pose."""
    (knees,), (data,) = knee_hinges(body, 100, OPTIONS)
    q = np.array(body.qpos0)
    for name, vector in turn.items():
        at = body.topology.joint_qpos[body.topology.joint_names.index(name)]
        q[at : at + 4] = Rotation.from_rotvec(vector).as_quat(scalar_first=True)
    row = {k: v[0] for k, v in data.items()}
    return np.asarray(knees.function(body, jnp.asarray(q)[None], row)).reshape(2, 3)


def test_flexion_is_free_and_all_else_is_not() -> None:
    body = legs()
    bone = np.array([-0.1, 0.0, -0.4]) / np.hypot(0.1, 0.4)
    across = np.cross(bone, [0.0, 1.0, 0.0])
    scale = 1 / (OPTIONS.prior.knee_sigma * np.sqrt(100))
    np.testing.assert_allclose(values(body, {"RightKnee": 1.2 * across}), 0.0, atol=1e-12)
    for axis in (bone, np.array([0.0, 1.0, 0.0])):
        found = values(body, {"RightKnee": 0.1 * axis})
        assert np.linalg.norm(found[0]) == pytest.approx(0.1 * scale)
        np.testing.assert_allclose(found[1], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    "body",
    [legs('type="hinge" axis="1 0 0"'), legs(foot="Hoof"), mj.human()],
    ids=["hinges", "no feet", "human"],
)
def test_other_bodies_have_none(body: Body) -> None:
    assert knee_hinges(body, 100, OPTIONS) == ((), ())


def test_it_can_be_switched_off() -> None:
    off = dataclasses.replace(OPTIONS, prior=mj.PriorOptions(knee_sigma=0.0))
    assert knee_hinges(legs(), 100, off) == ((), ())


def test_long_recordings_count_as_so_many_observations() -> None:
    few, many = (knee_hinges(legs(), n, OPTIONS)[1][0]["root_information"] for n in (100, 5000))
    sigma, samples = OPTIONS.prior.knee_sigma, OPTIONS.noise.independent_samples
    assert (few**2).sum() == pytest.approx(1 / sigma**2)
    assert (many**2).sum() == pytest.approx(5000 / samples / sigma**2)


def test_data_of_user_residuals_must_match() -> None:
    recording = record(seconds=0.5)
    with pytest.raises(InputError, match="user_data has 1 entries for 0 user residuals"):
        mj.optimise(recording, initial=mj.ekf(recording), user_data=(None,))


@pytest.mark.parametrize("names", [("knees",), ("range",), ("mine", "mine")])
def test_names_of_user_residuals_are_their_own(names: tuple[str, ...]) -> None:
    recording = record(seconds=0.5)
    residuals = tuple(mj.UserResidual(n, lambda body, q, data: q[0, :1]) for n in names)
    with pytest.raises(InputError, match=f"'{names[0]}': the name is taken"):
        mj.optimise(
            recording,
            initial=mj.ekf(recording),
            options=mj.OptimiseOptions(user_residuals=residuals),
        )
