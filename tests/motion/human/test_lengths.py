"""Segment lengths: overrides, and their derivatives against bodies built anew."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from mocap_jax.body import Body, frames, site_frames
from mocap_jax.errors import InputError
from mocap_jax.motion import (
    XSENS_SEGMENTS,
    builtin_motion,
    human,
    segment_lengths,
    with_segment_lengths,
)
from mocap_jax.simulation import default_suit, mount

RNG = np.random.default_rng(3)
PARTS = tuple(dict.fromkeys(n.replace("Right", "").replace("Left", "") for n in XSENS_SEGMENTS))


@pytest.fixture(scope="module")
def pose() -> jnp.ndarray:
    return builtin_motion("routine").trajectory.q[1700]


@pytest.fixture(scope="module")
def suited() -> Body:
    body = human()
    return mount(body, default_suit(body))


def joint_centres(body: Body) -> dict[str, np.ndarray]:
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return {model.body(i).name: data.xpos[i] for i in range(1, model.nbody)}


def test_every_segment_has_a_length_and_takes_another() -> None:
    usual = segment_lengths(human())
    assert tuple(usual) == XSENS_SEGMENTS
    lengths = {name: 1.2 * length for name, length in usual.items()}
    again = segment_lengths(human(lengths=lengths))
    assert again == pytest.approx(lengths, rel=1e-12)


def test_length_is_the_distance_of_joints() -> None:
    points = joint_centres(human(lengths={"UpperArm": 0.31, "Foot": 0.16, "LeftLowerLeg": 0.40}))
    distance = lambda a, b: np.linalg.norm(points[a] - points[b])  # noqa: E731
    for side in ("Left", "Right"):
        assert distance(f"{side}UpperArm", f"{side}ForeArm") == pytest.approx(0.31)
        assert distance(f"{side}Foot", f"{side}Toe") == pytest.approx(0.16)
    assert distance("LeftLowerLeg", "LeftFoot") == pytest.approx(0.40)
    assert distance("RightLowerLeg", "RightFoot") == pytest.approx(0.246 * 1.75)


def test_other_segments_mass_and_soles_stay() -> None:
    usual = segment_lengths(human())
    body = human(lengths={"UpperLeg": 0.50})
    changed = {n for n, length in segment_lengths(body).items() if abs(length - usual[n]) > 1e-9}
    assert changed == {"LeftUpperLeg", "RightUpperLeg"}
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    low = data.geom_xpos[:, 2] - model.geom_size[:, 0]
    low -= model.geom_size[:, 1] * np.abs(data.geom_xmat[:, 8])
    assert low.min() == pytest.approx(0.0, abs=1e-9)
    assert model.body_mass.sum() == pytest.approx(70.0, rel=1e-14)
    assert body.qpos0[2] == pytest.approx(0.530 * 1.75 + 0.50 - usual["LeftUpperLeg"])


def test_a_side_goes_before_both() -> None:
    lengths = segment_lengths(human(lengths={"LeftHand": 0.15, "Hand": 0.2}))
    assert (lengths["LeftHand"], lengths["RightHand"]) == pytest.approx((0.15, 0.2))


def test_wrong_lengths_are_refused() -> None:
    with pytest.raises(InputError, match=r"unknown segment 'Thigh'; valid: .*UpperLeg.*one side"):
        human(lengths={"Thigh": 0.4})
    with pytest.raises(InputError, match=r"lengths\['UpperLeg'\] must be 0.171 to 1.07 m .* 42"):
        human(lengths={"UpperLeg": 42.0})
    with pytest.raises(InputError, match="must be"):
        human(lengths={"UpperLeg": float("nan")})
    with pytest.raises(InputError, match="one value for each of the 2 names"):
        with_segment_lengths(human(), jnp.ones(3), ("UpperLeg", "Hand"))
    with pytest.raises(InputError, match="more than one length"):
        with_segment_lengths(human(), jnp.ones(2), ("UpperLeg", "LeftUpperLeg"))
    other = "<mujoco><worldbody><body name='Pelvis'><freejoint/><geom size='.1'/></body>"
    from mocap_jax.body import load_body

    with pytest.raises(InputError, match=r"bodies made by human\(\)"):
        segment_lengths(load_body(other + "</worldbody></mujoco>"))


@pytest.mark.parametrize("sex", ["female", None])
@pytest.mark.parametrize("names", [PARTS, XSENS_SEGMENTS, ("LeftUpperLeg", "Foot")])
def test_changed_body_is_the_body_built_anew(names: tuple[str, ...], sex, pose) -> None:
    body = human(1.68, 61.0, sex)
    usual = segment_lengths(body)
    lengths = {n: usual.get(n, usual.get("Left" + n)) * RNG.uniform(0.8, 1.25) for n in names}
    changed = with_segment_lengths(body, jnp.array(list(lengths.values())), names)
    anew = human(1.68, 61.0, sex, lengths)
    np.testing.assert_allclose(changed.body_pos, anew.body_pos, atol=1e-12)
    np.testing.assert_allclose(changed.qpos0, anew.qpos0, atol=1e-12)
    np.testing.assert_allclose(
        frames(changed, pose).position, frames(anew, pose).position, atol=1e-12
    )


def test_usual_lengths_change_nothing(suited: Body) -> None:
    lengths = jnp.array(list(segment_lengths(suited).values()))
    same = with_segment_lengths(suited, lengths)
    for field in ("body_pos", "site_pos", "qpos0"):
        np.testing.assert_allclose(getattr(same, field), getattr(suited, field), atol=1e-14)


def test_sites_move_along_their_segment(suited: Body) -> None:
    longer = with_segment_lengths(suited, jnp.array([0.50]), ("UpperLeg",))
    i = suited.site_index("left_thigh")
    ratio = 0.50 / segment_lengths(suited)["LeftUpperLeg"]
    np.testing.assert_allclose(
        longer.site_pos[i], suited.site_pos[i] * np.array([1, 1, ratio]), atol=1e-12
    )
    j = suited.site_index("left_shank")
    np.testing.assert_allclose(longer.site_pos[j], suited.site_pos[j], atol=1e-12)


def test_derivatives_agree_with_differences(suited: Body, pose: jnp.ndarray) -> None:
    names = PARTS
    usual = segment_lengths(suited)
    x = jnp.array([usual.get(n, usual.get("Left" + n)) for n in names]) * 1.03

    @jax.jit
    def sites(lengths: jnp.ndarray) -> jnp.ndarray:
        return site_frames(with_segment_lengths(suited, lengths, names), pose).position.ravel()

    J = jax.jit(jax.jacfwd(sites))(x)
    reverse = jax.jit(jax.grad(lambda z: (sites(z) ** 2).sum()))(x)
    step = 1e-6
    differences = jnp.stack(
        [
            (sites(x.at[i].add(step)) - sites(x.at[i].add(-step))) / (2 * step)
            for i in range(len(x))
        ],
        axis=1,
    )
    np.testing.assert_allclose(J, differences, atol=1e-7)
    np.testing.assert_allclose(reverse, 2 * sites(x) @ J, atol=1e-10)
    assert names[-1] == "Toe" and not J[:, -1].any()  # nothing is worn beyond
    assert float(jnp.abs(J).sum(axis=0)[:-1].min()) > 0.1  # every other length moves some device


def test_many_bodies_at_once(pose: jnp.ndarray) -> None:
    body = human()
    usual = jnp.array(list(segment_lengths(body).values()))
    many = usual * jnp.linspace(0.9, 1.1, 5)[:, None]
    place = lambda lengths: frames(with_segment_lengths(body, lengths), pose).position  # noqa: E731
    together = jax.vmap(place)(many)
    np.testing.assert_allclose(together[4], place(many[4]), atol=1e-12)


def test_the_mjcf_follows_plain_lengths(suited: Body) -> None:
    """The text compiles to what `human(lengths=...)` is, sites included."""
    lengths = {"LeftUpperLeg": 0.47, "Foot": 0.16, "Shoulder": 0.20, "Hand": 0.21, "T8": 0.17}
    changed = with_segment_lengths(suited, lengths)
    mine, anew = changed.mujoco_model(), human(lengths=lengths).mujoco_model()
    for field in ("body_pos", "body_mass", "body_inertia", "body_ipos", "geom_pos", "geom_size",
                  "qpos0"):  # fmt: skip
        np.testing.assert_allclose(getattr(mine, field), getattr(anew, field), atol=1e-9)
    np.testing.assert_allclose(mine.site_pos, changed.site_pos, atol=1e-12)
    np.testing.assert_allclose(mine.body_pos, changed.body_pos, atol=1e-12)
    np.testing.assert_allclose(mine.qpos0, changed.qpos0, atol=1e-12)
    assert segment_lengths(changed) == pytest.approx(segment_lengths(human(lengths=lengths)))
    assert segment_lengths(changed)["LeftUpperLeg"] == pytest.approx(0.47)


def test_lengths_can_be_changed_twice(suited: Body) -> None:
    twice = with_segment_lengths(
        with_segment_lengths(suited, {"UpperLeg": 0.5, "UpperArm": 0.3}), {"UpperLeg": 0.45}
    )
    once = with_segment_lengths(suited, {"UpperLeg": 0.45, "UpperArm": 0.3})
    np.testing.assert_allclose(twice.body_pos, once.body_pos, atol=1e-12)
    np.testing.assert_allclose(twice.site_pos, once.site_pos, atol=1e-12)
    assert segment_lengths(twice) == pytest.approx(segment_lengths(once), rel=1e-12)


def test_traced_lengths_make_no_mjcf() -> None:
    body = human()
    seen = []

    def height(length: jnp.ndarray) -> jnp.ndarray:
        longer = with_segment_lengths(body, {"UpperLeg": length})
        seen.append(longer)
        return longer.qpos0[2]

    assert float(jax.grad(height)(0.45)) == pytest.approx(1.0)
    assert seen[0].xml == "" and body.xml
    with pytest.raises(InputError, match="no MJCF .*traced"):
        segment_lengths(seen[0])
    made = jax.jit(lambda x: with_segment_lengths(body, x, ("UpperLeg",)))(jnp.array([0.45]))
    with pytest.raises(InputError, match="no MJCF"):
        made.mujoco_model()


def test_plain_lengths_within_a_transformation_keep_the_mjcf() -> None:
    """What is traced there is something else."""
    seen = []

    def scaled(x: jnp.ndarray) -> jnp.ndarray:
        longer = with_segment_lengths(human(), {"UpperLeg": 0.45})
        seen.append(longer.xml)
        return x * longer.qpos0[2]

    jax.jit(scaled)(1.0)
    assert seen == [with_segment_lengths(human(), {"UpperLeg": 0.45}).xml]


@pytest.mark.parametrize("length", [0.0, -0.3, float("nan"), float("inf"), 0.01])
def test_impossible_lengths_are_refused(length: float) -> None:
    for lengths in ({"LeftShoulder": length}, {"LeftShoulder": jnp.array(length)}):
        with pytest.raises(InputError, match=r"length of LeftShoulder must be above 0\.0\d+ m"):
            with_segment_lengths(human(), lengths)
