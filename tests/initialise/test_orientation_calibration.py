"""Sensors are placed on segments by their orientations in a known pose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body, site_frames
from mocap_jax.errors import InputError
from mocap_jax.initialise import Heading, calibrate_to_pose
from mocap_jax.recording import InertialStream, Recording, Setup

XML = """<mujoco><compiler angle="radian"/><worldbody><body name="trunk" pos="0 0 1"
euler="0.1 0 0"><freejoint/><geom size="0.1"/><body name="arm" pos="0 0 0.3"><joint name="elbow"
axis="0 1 0"/><geom size="0.1" pos="0 0 0.2"/></body></body></worldbody></mujoco>"""


def recording(offsets: dict[str, Rotation], body, q, turn: float) -> Recording:
    """All sensors see the world turned about the vertical."""
    from mocap_jax.io.world_frames import world_frames

    R, _ = world_frames(body, q[None])
    streams = {}
    for name, offset in offsets.items():
        b = body.topology.body_index(name.removesuffix("_s"))
        R_seen = Rotation.from_euler("z", -turn) * Rotation.from_matrix(R[0, b]) * offset
        quat = np.tile(R_seen.as_quat(scalar_first=True), (3, 1))
        quat[0] = np.nan
        none = np.full((3, 3), np.nan)
        streams[name] = InertialStream(np.arange(3) / 100, none, none, quat)
    return Recording(streams, None, None, {}, None, None, Setup(), None)


@pytest.fixture(scope="module")
def body():
    return load_body(XML)


OFFSETS = {"trunk_s": Rotation.from_euler("y", 1.5), "arm_s": Rotation.from_rotvec([0.4, 1, 2])}
SEGMENTS = {"trunk_s": "trunk", "arm_s": "arm"}


def test_offsets_are_found_in_any_pose(body):
    q = np.asarray(body.qpos0).copy()
    q[7] = 0.6
    found = calibrate_to_pose(recording(OFFSETS, body, q, 0.0), body, SEGMENTS, pose=q)
    for name, offset in OFFSETS.items():
        np.testing.assert_allclose(found.R_segment_sensor[name], offset.as_matrix(), atol=1e-9)
        site = found.body.topology.site_index(name)
        R = np.asarray(site_frames(found.body, q).rotation)[site]
        seen = Rotation.from_quat(found.recording.inertial[name].orientation[1], scalar_first=True)
        np.testing.assert_allclose(R, seen.as_matrix(), atol=1e-9)
    assert found.heading == 0.0
    arm = found.body.topology.site_index("arm_s")
    np.testing.assert_allclose(np.asarray(found.body.site_pos)[arm], [0, 0, 0.2], atol=1e-12)
    assert [s.site for s in found.recording.setup.sensors] == list(SEGMENTS)
    assert found.recording.setup.sensors[0].rate_hz == pytest.approx(100.0)


@pytest.mark.parametrize("turn", [-2.5, 0.3, 3.0])
def test_heading_is_found_by_a_sensor_that_looks_forward(body, turn: float):
    level = {"trunk_s": Rotation.from_euler("y", np.pi / 2), "arm_s": OFFSETS["arm_s"]}
    measured = recording(level, body, np.asarray(body.qpos0), turn)
    found = calibrate_to_pose(measured, body, SEGMENTS, heading=Heading("trunk_s", "z"))
    assert found.heading == pytest.approx(turn, abs=1e-9)
    for name, offset in level.items():
        np.testing.assert_allclose(found.R_segment_sensor[name], offset.as_matrix(), atol=1e-9)


def test_opensense_takes_the_angle_in_space():
    body = load_body(XML.replace('euler="0.1 0 0"', ""))
    sloping = {"trunk_s": Rotation.from_euler("y", np.pi / 2 - 0.3), "arm_s": OFFSETS["arm_s"]}
    measured = recording(sloping, body, np.asarray(body.qpos0), 0.4)
    found = [
        calibrate_to_pose(measured, body, SEGMENTS, heading=Heading("trunk_s", "z", rule)).heading
        for rule in ("horizontal", "opensense")
    ]
    assert found[0] == pytest.approx(0.4, abs=1e-9)
    assert found[1] == pytest.approx(np.arccos(np.cos(0.4) * np.cos(0.3)), abs=1e-9)


def test_calibrating_again_moves_the_site(body):
    q = np.asarray(body.qpos0)
    first = calibrate_to_pose(recording(OFFSETS, body, q, 0.0), body, SEGMENTS,
                              positions={"arm_s": (0.1, 0.0, 0.2)})  # fmt: skip
    again = calibrate_to_pose(
        recording({n: Rotation.identity() for n in OFFSETS}, body, q, 0.0), first.body, SEGMENTS
    )
    i = again.body.topology.site_index("arm_s")
    assert np.asarray(again.body.site_pos)[i].tolist() == [0.1, 0.0, 0.2]
    np.testing.assert_allclose(np.abs(np.asarray(again.body.site_quat)[i]), [1, 0, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    ("segments", "heading", "message"),
    [
        ({"hand_s": "arm"}, None, "sensor 'hand_s'"),
        ({"arm_s": "leg"}, None, "segment of sensor 'arm_s': 'leg'"),
        (SEGMENTS, Heading("leg_s", "z"), "sensor 'leg_s'"),
        (SEGMENTS, Heading("arm_s", "w"), "axis 'w'"),
        (SEGMENTS, Heading("arm_s", "x", "vertical"), "heading: rule 'vertical'; valid: horiz"),
        (SEGMENTS, Heading("trunk_s", "y"), "points up or down"),
    ],
)
def test_wrong_names(body, segments, heading, message):
    upright = {"trunk_s": Rotation.from_euler("x", np.pi / 2), "arm_s": OFFSETS["arm_s"]}
    measured = recording(upright, body, np.asarray(body.qpos0), 0.0)
    with pytest.raises(InputError, match=message):
        calibrate_to_pose(measured, body, segments, heading=heading)
