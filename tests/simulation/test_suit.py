"""The standard suit on human bodies, mounting, and set-up files."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion, human, load_motion, together
from mocap_jax.simulation import (
    SUITS,
    VALIDATION,
    Mounting,
    Suit,
    default_suit,
    load_suit,
    mount,
    named_suit,
    save_suit,
    simulate,
    suits_together,
)
from mocap_jax.trajectory import Trajectory

BOARDS = {
    "pelvis", "abdomen", "chest", "head",
    *(
        f"{side}_{part}"
        for side in ("left", "right")
        for part in ("shoulder", "upper_arm", "forearm", "hand", "thigh", "shank", "foot")
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def person():
    return human()


def _bodies(shared_data):
    cmu = shared_data / "mjcf_humanoid_cmu" / "humanoid_CMU_V2020.xml"
    clip = shared_data / "cmu_mocap" / "02_01.amc"
    return [load_body(cmu, free_root=True), load_motion(clip).body]


def _check(body):
    suit = default_suit(body)
    assert {b.name for b in suit.boards} == BOARDS
    assert len(suit.sources) == 8 and suit.source_sites[-1] == "source/hat"
    assert not suit.omitted
    worn = mount(body, suit)
    model = worn.mujoco_model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    at = lambda name: data.site(name).xpos  # noqa: E731
    axis = lambda name: data.site(name).xmat.reshape(3, 3)[:, 2]  # noqa: E731
    left = at("left_thigh") - at("right_thigh")
    up = at("head") - at("pelvis")
    forward = np.cross(left, up)
    left, up, forward = (x / np.linalg.norm(x) for x in (left, up, forward))
    for source in suit.source_sites[:-1]:
        assert axis(source) @ forward > 0.6, source
    assert axis("source/hat") @ up < -0.9
    for side, sign in (("left", 1), ("right", -1)):
        for part in ("upper_arm", "forearm", "hand", "thigh", "shank", "foot"):
            assert sign * (at(f"{side}_{part}") - at("pelvis")) @ left > 0.02
    for board in suit.boards:
        segment = model.site(board.name).bodyid[0]
        outward = (at(board.name) - data.xipos[segment]) @ axis(board.name)
        assert outward > 0, f"{board.name} faces inwards"
    before = set(body.topology.body_names)
    assert before == set(worn.topology.body_names)
    np.testing.assert_array_equal(body.body_pos, worn.body_pos)


def test_standard_suit_fits_the_built_in_human(person):
    _check(person)


def test_standard_suit_fits_other_human_bodies(shared_data):
    for body in _bodies(shared_data):
        _check(body)


def test_most_microphones_hear_a_source_most_of_the_time(shared_data):
    recording = simulate(load_motion(shared_data / "cmu_mocap" / "02_01.amc"), profile="ideal")
    ranges = recording.ranges
    rounds = np.floor(np.asarray(ranges.time) / 0.064).astype(int)
    heard = [
        len(set(rounds[np.asarray(ranges.receiver) == r])) / (rounds.max() + 1) for r in range(18)
    ]
    assert np.mean(np.array(heard) > 0.5) >= 0.7


def test_missing_segments_are_named(suit):
    arm_only = load_body(
        """<mujoco><worldbody><body name="T8" pos="0 0 1"><freejoint name="root"/>
        <geom size=".1"/><body name="LeftUpperArm" pos="0 .2 0"><joint type="ball"/>
        <geom type="capsule" size=".04" fromto="0 0 0 0 0.3 0"/>
        </body></body></worldbody></mujoco>"""
    )
    found = default_suit(arm_only)
    assert {"pelvis", "abdomen", "chest", "left_upper_arm"} == {b.name for b in found.boards}
    assert "board left_hand: no segment LeftHand" in found.omitted


def test_body_that_is_not_human_is_refused(motion):
    with pytest.raises(InputError, match="base, upper, lower"):
        default_suit(motion.body)


def test_set_up_file_round_trip(tmp_path, person):
    suit = default_suit(person)
    path = tmp_path / "suit.toml"
    save_suit(path, suit)
    again = load_suit(path, person)
    for a, b in zip((*suit.boards, *suit.sources), (*again.boards, *again.sources), strict=True):
        assert a.name == b.name and a.segment == b.segment and a.position == b.position
        np.testing.assert_allclose(a.orientation, b.orientation, atol=1e-15)


def test_set_up_file_adds_to_the_standard_suit(tmp_path, person):
    path = tmp_path / "suit.toml"
    path.write_text(
        'layout = "default"\n[[boards]]\nname = "left_toe"\nsegment = "LeftToe"\n'
        "position = [0.0, 0.0, 0.03]\n"
    )
    suit = load_suit(path, person)
    assert {b.name for b in suit.boards} == BOARDS | {"left_toe"}


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("boards = 3", "boards"),
        ("[[boards", "not valid TOML"),
        ("[[boards]]\nname = 'a'\nposition = [0, 0, 0]", "'segment' is missing"),
        ("[[boards]]\nname = 'a'\nsegment = 'Hed'\nposition = [0, 0, 0]", "Head"),
        ("[[boards]]\nname = 'a'\nsegment = 'Head'\nposition = [0, 0]", "3 numbers"),
        ("[[boards]]\nname = 'a'\nsegment = 'Head'\nposition = [0, 0, 0]\ncolour = 1", "colour"),
        (
            "[[boards]]\nname = 'a'\nsegment = 'Head'\nposition = [0, 0, 0]\n"
            "orientation = [1, 1, 0, 0]",
            "unit quaternion",
        ),
        ("[[sources]]\nname = 'a'\nsegment = 'Head'\nposition = [0, 0, 0]", "no boards"),
        ("layout = 'defalt'", "default"),
        ("sensors = 3", "unknown entry"),
    ],
)
def test_wrong_set_up_files_get_one_clear_line(tmp_path, person, text, word):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=word) as caught:
        load_suit(path, person)
    assert "wrong.toml" in str(caught.value) and "\n" not in str(caught.value)


def test_missing_set_up_file(tmp_path):
    with pytest.raises(InputError, match="no such set-up file"):
        load_suit(tmp_path / "none.toml")


def test_names_worn_twice_are_refused(motion, suit):
    worn = mount(motion.body, suit)
    with pytest.raises(InputError, match="site 'base' exists already"):
        mount(worn, suit)


def test_xsens_names_hold_for_bodies_of_several_people() -> None:
    """`a/Pelvis` is what the body of `a` calls `pelvis`."""
    segment = "<body name='pelvis'><freejoint/><geom size='.1'/></body>"
    xml = f"<mujoco><worldbody>{segment}</worldbody></mujoco>"
    one = Motion(
        "still",
        load_body(xml),
        Trajectory(np.arange(9) / 60, np.tile([0, 0, 1, 1, 0, 0, 0.0], (9, 1))),
    )
    both = together({"a": one, "b": one})
    worn = suits_together(dict.fromkeys("ab", Suit((Mounting("belt", "Pelvis", (0, 0, 0)),))))
    assert mount(both.body, worn).topology.site_names == ("a/belt", "b/belt")


def test_bare_bodies_get_capsules():
    from mocap_jax.simulation.mounting import with_shapes

    bare = load_body(
        """<mujoco><worldbody><body name="a"><freejoint name="root"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <body name="b" pos="0 0 0.5"><joint type="ball"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""
    )
    model = with_shapes(bare).mujoco_model()
    assert model.ngeom == 1 and model.geom_bodyid[0] == 1
    assert model.geom_size[0, 1] == pytest.approx(0.25)


def test_named_suits_are_boards_of_the_standard_suit(tmp_path):
    body = human()
    standard = {b.name: b for b in default_suit(body).boards}
    for name, boards in SUITS.items():
        suit = named_suit(name, body)
        assert suit.boards == tuple(standard[b] for b in boards) and not suit.sources
        file = tmp_path / "suit.toml"
        file.write_text(f'layout = "{name}"\n')
        assert load_suit(file, body).boards == suit.boards
    assert set(SUITS["tnt15"]) == {*SUITS["sip6_tnt15"], *VALIDATION}
    with pytest.raises(InputError, match="unknown suit 'sip6'; valid: sip6_head, sip6_tnt15"):
        named_suit("sip6", body)
