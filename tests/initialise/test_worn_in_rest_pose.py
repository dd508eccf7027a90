"""Boards of a recording on another skeleton: in the rest pose they are where they were."""

from __future__ import annotations

import dataclasses
import json

import mujoco
import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.initialise import declared_pose, worn_in_rest_pose
from mocap_jax.metrics.align import align
from mocap_jax.simulation import Anchor, Suit, mount, named_suit


def sites(body: mj.Body, q: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Place [m] relative to the joint of its segment, and orientation in the world, by C MuJoCo."""
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    data.qpos = q
    mujoco.mj_kinematics(model, data)
    return {
        model.site(i).name: (
            data.site_xpos[i] - data.xpos[model.site_bodyid[i]], data.site_xmat[i].copy(),
        )
        for i in range(model.nsite)
    }  # fmt: skip


@pytest.fixture(scope="module")
def recording() -> mj.Recording:
    """Half a second of walking with six boards."""
    walk = mj.builtin_motion("walking")
    part = dataclasses.replace(
        walk, trajectory=mj.Trajectory(walk.trajectory.time[:50], walk.trajectory.q[300:350])
    )
    return mj.simulate(
        part, profile="ideal", suit=named_suit("sip6_tnt15", walk.body),
        options=mj.SimulationOptions(orientations=True, inertial_rate_hz=60),
    )  # fmt: skip


@pytest.fixture(scope="module")
def skeleton(tmp_path_factory) -> mj.Body:
    """A smaller person's joints, arms straight out forward at rest."""
    person = mj.human(1.6)
    q = np.array(person.qpos0)
    for side in ("Left", "Right"):
        at = person.topology.joint_qpos[person.topology.joint_index(f"{side}UpperArm")]
        q[at : at + 4] = [np.sqrt(0.5), 0, -np.sqrt(0.5), 0]
    frames, names = mj.frames(person, q), person.topology.body_names
    file = tmp_path_factory.mktemp("skeleton") / "own.json"
    file.write_text(json.dumps({
        "joints": names[1:], "positions": np.asarray(frames.position)[1:].tolist(),
        "parents": [None if p == 0 else names[p] for p in person.topology.body_parent[1:]],
    }))  # fmt: skip
    return mj.load_skeleton(file)


def test_boards_keep_their_orientation_in_the_rest_pose(recording, skeleton):
    worn, body = mj.wear(recording, skeleton)
    own = mj.load_body(recording.body_xml)
    before = sites(own, declared_pose(recording.setup.rest, own))
    after = sites(body, declared_pose(worn.setup.rest, body))
    assert before.keys() == after.keys() and worn.body_xml == body.xml
    for name, (place, orientation) in before.items():
        np.testing.assert_allclose(after[name][1], orientation, atol=0.02, err_msg=name)
        np.testing.assert_allclose(after[name][0], 1.6 / 1.75 * place, atol=0.003, err_msg=name)


def test_anchors_stand_where_they_stood(recording, skeleton):
    ear = Anchor("ear", (1.0, 2.0, 2.5), (0.6, 0.0, 0.8, 0.0))
    room = mount(mj.load_body(recording.body_xml), Suit((), anchors=(ear,)))
    _, body = mj.wear(dataclasses.replace(recording, body_xml=room.xml), skeleton)
    i = body.site_index("anchor/ear")
    assert body.topology.site_body[i] == 0
    np.testing.assert_allclose(body.site_pos[i], ear.position)
    np.testing.assert_allclose(body.site_quat[i], ear.orientation)


def test_a_person_stands_where_they_stood(recording, skeleton):
    """Shorter legs lower the root; they do not move it over the floor."""
    own, rest = mj.load_body(recording.body_xml), recording.setup.rest
    before = declared_pose(rest, own)
    pose = {**rest.pose, own.topology.joint_names[0]: (3.0, -2.0, *before[2:7].tolist())}
    setup = dataclasses.replace(recording.setup, rest=dataclasses.replace(rest, pose=pose))
    worn, body = mj.wear(dataclasses.replace(recording, setup=setup), skeleton)
    after = declared_pose(worn.setup.rest, body)
    np.testing.assert_allclose(after[:2], (3.0, -2.0), atol=0.02)
    assert after[2] < 0.97 * before[2]


def test_a_recording_on_the_skeleton_is_estimated(recording, skeleton):
    """Orientations alone: limbs with boards point where the truth's do."""
    solution = mj.orientation_pass(*mj.wear(recording, skeleton))
    pair = align(solution, recording)
    assert len(pair.time) > 20
    for upper, lower in (("LeftForeArm", "LeftHand"), ("RightLowerLeg", "RightFoot")):
        found, true = (
            along(body, q[-1], upper, lower)
            for body, q in ((pair.body, pair.q), (pair.reference_body, pair.reference_q))
        )
        assert found @ true > np.cos(np.radians(2.0)), upper


def along(body: mj.Body, q: np.ndarray, upper: str, lower: str) -> np.ndarray:
    """Direction of a limb in the world, by C MuJoCo."""
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    data.qpos = q
    mujoco.mj_kinematics(model, data)
    offset = data.body(lower).xpos - data.body(upper).xpos
    return offset / np.linalg.norm(offset)


def test_a_skeleton_without_a_board_s_segment(recording):
    legs = """<mujoco><worldbody><body name="Pelvis"><freejoint/><geom size=".1"/>
    <body name="LeftUpperLeg" pos="0 .1 0"><joint type="ball"/><geom size=".1"/></body>
    </body></worldbody></mujoco>"""
    with pytest.raises(InputError, match="RightUpperLeg"):
        mj.wear(recording, mj.load_body(legs))
    with pytest.raises(InputError, match="no body"):
        worn_in_rest_pose(dataclasses.replace(recording, body_xml=None), mj.load_body(legs))
