"""Ball joints in place of hinges: same skeleton, free turns, no fingers."""

from __future__ import annotations

import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.body import frames
from mocap_jax.errors import InputError


def test_the_human_gets_23_free_segments():
    body, ball = mj.human(), mj.ball_jointed(mj.human())
    assert ball.topology.body_names == body.topology.body_names
    assert set(ball.topology.joint_types) == {"free", "ball"}
    assert ball.nv == 6 + 3 * 22
    own, other = frames(body, body.qpos0), frames(ball, ball.qpos0)
    np.testing.assert_allclose(own.position, other.position, atol=1e-12)
    np.testing.assert_allclose(own.rotation, other.rotation, atol=1e-12)
    assert np.isinf(np.asarray(ball.joint_range)[1:]).all()


def test_sites_stay_and_fingers_are_fixed():
    xml = """<mujoco><worldbody><body name="Pelvis"><freejoint/><geom size=".1"/>
    <body name="LeftUpperArm" pos="0 .2 .4"><joint axis="1 0 0" pos="0 0 .01"/>
    <joint axis="0 1 0" pos="0 0 .01"/><geom size=".1"/><site name="arm" pos=".1 0 0"/>
    <body name="lThumb" pos="0 .3 0"><joint/><geom size=".1"/></body></body></body></worldbody>
    <actuator/></mujoco>"""
    ball = mj.ball_jointed(mj.load_body(xml))
    assert ball.topology.joint_names[1:] == ("LeftUpperArm",)
    np.testing.assert_allclose(ball.joint_pos[1], [0, 0, 0.01])
    assert ball.topology.site_names == ("arm",)


def test_bodies_without_known_segments_are_refused():
    xml = """<mujoco><worldbody><body name="box"><joint/><geom size=".1"/></body></worldbody>
    </mujoco>"""
    with pytest.raises(InputError, match="its segments are box"):
        mj.ball_jointed(mj.load_body(xml))


def test_a_root_of_slides_keeps_its_joints():
    """Motion files without a free joint: translation and rotation of the root stay as they are."""
    xml = """<mujoco><worldbody><body name="Pelvis"><joint type="slide" axis="1 0 0"/>
    <joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/><geom size=".1"/>
    <body name="T8" pos="0 0 .4"><joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/>
    <geom size=".1"/></body></body></worldbody></mujoco>"""
    ball = mj.ball_jointed(mj.load_body(xml))
    assert ball.topology.joint_types == ("slide", "slide", "hinge", "ball")
