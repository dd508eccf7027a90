"""Sensors of a recording go to the same places of another body."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mocap_jax.body import load_body
from mocap_jax.conversion import wear
from mocap_jax.errors import InputError
from mocap_jax.io import validate_recording
from mocap_jax.motion import human, segment_lengths
from mocap_jax.recording import (
    InertialStream,
    RangeStream,
    Recording,
    SensorSpec,
    Setup,
    Truth,
)
from mocap_jax.simulation import Anchor, Mounting, Suit, mount
from mocap_jax.simulation.profiles import PROFILES
from mocap_jax.simulation.true_body import true_body
from mocap_jax.trajectory import Trajectory

TURNED = (0.5, 0.5, 0.5, 0.5)
SUIT = Suit(
    (
        Mounting("thigh", "LeftUpperLeg", (0.05, 0.02, -0.2), TURNED),
        Mounting("chest", "T8", (0.1, 0, 0.1)),
    ),
    (Mounting("belly", "Pelvis", (0.1, 0.0, 0.05), TURNED),),
)


def recording(body_xml: str | None, names=("thigh", "chest"), **facts: str) -> Recording:
    time = np.arange(50) / 100
    still = np.tile([0.0, 0.0, 9.81], (50, 1))
    board = InertialStream(time, still, 0 * still, np.full((50, 4), np.nan))
    return Recording(
        inertial=dict.fromkeys(names, board), ranges=None, root=None, magnetic={},
        temperature=None, truth=None, body_xml=body_xml,
        setup=Setup(tuple(SensorSpec(n, n, 100.0) for n in names), provenance=facts),
    )  # fmt: skip


def test_the_same_share_of_every_segment():
    tall = human(1.9, 80.0, None, {"UpperLeg": 0.55})
    one = np.ones(50)
    ranges = RangeStream(
        one.cumsum(), 0 * one.astype(int), 0 * one.astype(int), one, one,
        ("source/belly",), ("chest",),
    )  # fmt: skip
    whole = dataclasses.replace(recording(mount(human(), SUIT).xml), ranges=ranges)
    worn, body = wear(whole, tall)
    assert worn.body_xml == body.xml
    body, lengths, usual = load_body(worn.body_xml), segment_lengths(tall), segment_lengths(human())
    for device, site in zip(
        (*SUIT.boards, *SUIT.sources), ("thigh", "chest", "source/belly"), strict=True
    ):
        i = body.site_index(site)
        assert body.topology.body_names[body.topology.site_body[i]] == device.segment
        share = lengths[device.segment] / usual[device.segment]
        np.testing.assert_allclose(body.site_pos[i], share * np.array(device.position), rtol=1e-9)
        np.testing.assert_allclose(body.site_quat[i], device.orientation, atol=1e-12)
    assert segment_lengths(body) == pytest.approx(lengths)
    validate_recording(worn)


def test_anchors_stay_where_they_stand():
    half = float(np.sqrt(0.5))
    door = Anchor("door", (1.0, 2.0, 2.5), (half, half, 0.0, 0.0), emits=True)
    one, whole = np.ones(50), dataclasses.replace(SUIT, anchors=(door,))
    ranges = RangeStream(
        one.cumsum(), 0 * one.astype(int), 0 * one.astype(int), one, one,
        ("anchor/door", "source/belly"), ("chest",),
    )  # fmt: skip
    made = dataclasses.replace(recording(mount(human(), whole).xml), ranges=ranges)
    worn, body = wear(made, human(1.6))
    i = body.site_index("anchor/door")
    assert body.topology.site_body[i] == 0
    np.testing.assert_allclose(body.site_pos[i], door.position)
    np.testing.assert_allclose(body.site_quat[i], door.orientation)
    assert body.topology.site_body[body.site_index("source/belly")] > 0
    validate_recording(worn)


def test_a_sensor_in_the_world_that_is_no_anchor_is_refused():
    xml = mount(human(), SUIT).xml.replace("<worldbody>", '<worldbody><site name="lamp"/>')
    with pytest.raises(InputError, match="'lamp' of the recording's body is on no segment"):
        wear(recording(xml, ("lamp",)), human(1.6))


def test_without_a_body_the_provenance_says_where():
    plain = recording(None, ("s1", "Head"), **{"segment/s1": "RightLowerLeg"})
    worn, _ = wear(plain, human(1.6))
    topology = load_body(worn.body_xml).topology
    where = {n: topology.body_names[b] for n, b in zip(topology.site_names, topology.site_body,
                                                       strict=True)}  # fmt: skip
    assert where == {"s1": "RightLowerLeg", "Head": "Head"}
    assert "nominal" in worn.setup.provenance["mounting"]
    validate_recording(worn)


def test_a_body_with_the_sites_keeps_them():
    dressed = mount(human(1.6), SUIT)
    worn, body = wear(recording(mount(human(), SUIT).xml), dressed)
    assert worn.body_xml == body.xml == dressed.xml


OTHER = """<mujoco><worldbody><body name="Pelvis"><freejoint/><geom size=".1"/>
    <site name="thigh"/>{more}</body></worldbody></mujoco>"""


def test_the_truth_is_told_from_the_new_body():
    made = recording(mount(human(), SUIT).xml)
    told = {"mounting_rotation/thigh": np.array([0.3, 0.0, 0.0]), "speed_of_sound": np.array(340.0)}
    truth = Truth(Trajectory(np.arange(2.0), np.zeros((2, 1))), made.body_xml, told)
    worn, _ = wear(dataclasses.replace(made, truth=truth), human(1.6))
    np.testing.assert_allclose(worn.truth.parameters["mounting_rotation/thigh"], 0.0, atol=1e-12)
    assert float(worn.truth.parameters["speed_of_sound"]) == 340.0


def test_scales_of_the_truth_are_told_from_the_new_body():
    nominal, tall = mount(human(), SUIT), human(1.9, 80.0, None, {"UpperLeg": 0.55})
    true, told = true_body(nominal, SUIT, PROFILES["field"], seed=2)
    truth = Truth(Trajectory(np.arange(2.0), np.zeros((2, 1))), true.xml, told)
    made = dataclasses.replace(recording(nominal.xml), truth=truth)
    worn, body = wear(dataclasses.replace(made, setup=recording(None).setup), tall)
    now = worn.truth.parameters
    lengths, actual = segment_lengths(tall), segment_lengths(true)
    for name, length in lengths.items():
        assert now[f"segment_scale/{name}"] == pytest.approx(actual[name] / length, rel=1e-9)
    for site, segment in (("thigh", "LeftUpperLeg"), ("chest", "T8")):
        place = float(now[f"segment_scale/{segment}"]) * body.site_pos[body.site_index(site)]
        there = true.site_pos[true.site_index(site)]
        np.testing.assert_allclose(place + now[f"mounting_position/{site}"], there, atol=1e-12)


def test_what_cannot_be_told_is_refused():
    with pytest.raises(InputError, match="sensor s1: nothing says on which segment"):
        wear(recording(None, ("s1",)), human())
    with pytest.raises(InputError, match="neither body has a site for chest; .* own: thigh"):
        wear(recording(OTHER.format(more="")), human())
    with pytest.raises(InputError, match=r"another kind, .* no segment .* \(thigh, chest\)"):
        wear(recording(OTHER.format(more='<site name="chest"/>')), human())
