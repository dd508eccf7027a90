"""Body models of the rows: of the subject, rigged by hand, from height alone, too large."""

from __future__ import annotations

import dataclasses
from xml.etree import ElementTree

import numpy as np

import mocap_jax as mj
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.initialise import calibrate_to_pose, declared_pose
from mocap_jax.motion import Motion
from mocap_jax.simulation import named_suit
from mocap_jax.simulation.mounting import with_shapes

# Stature over the length of a leg, hip to ankle (Drillis and Contini 1966, in Winter 2009).
_STATURE = 1 / (0.245 + 0.246)
# Joint centres placed by hand are off by this much [m], per axis (Della Croce et al. 2005).
JOINT_CENTRE_ERROR = 0.015
# What turns in the body rigged by hand: its other segments move with their parents.
_BALLS = ("L5", "Head", "LeftUpperArm", "RightUpperArm", "LeftUpperLeg", "RightUpperLeg")
_HINGES = ("ForeArm_flexion", "ForeArm_pronation", "LowerLeg_flexion", "Foot_dorsiflexion")


def subject_body(recording: mj.Recording) -> mj.Body:
    """SIP: the subject's skeleton with a ball joint at every joint."""
    return mj.ball_jointed(mj.load_body(recording.body_xml))


def words_body(recording: mj.Recording) -> mj.Body:
    """SIP-BW: the built-in human of the subject's stature, which the length of the legs tells."""
    return mj.ball_jointed(mj.human(height=_leg(mj.load_body(recording.body_xml)) * _STATURE))


def manual_body(recording: mj.Recording, seed: int) -> mj.Body:
    """SIP-M: hinges at knees and elbows, 30 parameters, joint centres off by `JOINT_CENTRE_ERROR`.

    The subject's segment lengths are right but for that error.
    """
    body = mj.human_like(mj.load_body(recording.body_xml))
    tree = ElementTree.fromstring(body.xml)
    rng = np.random.default_rng([2017, seed])
    for element in tree.iter("body"):
        name = str(element.get("name"))
        for joint in [e for e in element if e.tag == "joint"]:
            label = str(joint.get("name"))
            if name not in _BALLS and not label.endswith(_HINGES):
                element.remove(joint)
        if name != "Pelvis" and element.find("joint") is not None:
            place = np.array([float(x) for x in str(element.get("pos")).split()])
            moved = place + JOINT_CENTRE_ERROR * rng.standard_normal(3)
            element.set("pos", numbers(moved))
    return mj.load_body(ElementTree.tostring(tree, encoding="unicode"))


def scaled_body(recording: mj.Recording, factor: float) -> mj.Body:
    """SIP-110, SIP-120: the subject's body, every length multiplied."""
    tree = ElementTree.fromstring(subject_body(recording).xml)
    for element in tree.iter():
        for key in ("pos", "fromto", "size"):
            text = element.get(key)
            if element.tag in ("body", "geom", "site", "joint", "inertial") and text:
                element.set(key, numbers(factor * float(x) for x in text.split()))
    return mj.load_body(ElementTree.tostring(tree, encoding="unicode"))


def worn(
    recording: mj.Recording, body: mj.Body, sensors: tuple[str, ...]
) -> tuple[mj.Recording, mj.Body]:
    """The recording of some sensors on another body, with offsets from the first frame (eq. 7).

    Boards sit where the suit puts them on that body; how they are turned on their segments follows
    from their first orientation and the declared pose.
    """
    own = mj.load_body(recording.body_xml)
    pose = _rest_pose(recording, own, body)
    places = {b.name: b for b in named_suit("tnt15", with_shapes(body)).boards}
    if "head" in sensors:
        places |= {b.name: b for b in named_suit("sip6_head", with_shapes(body)).boards}
    found = calibrate_to_pose(
        recording, body, {s: places[s].segment for s in sensors}, pose=pose,
        positions={s: places[s].position for s in sensors},
    )  # fmt: skip
    rest = dataclasses.replace(recording.setup.rest, pose=found.body.topology.by_joint(pose))
    setup = dataclasses.replace(found.recording.setup, rest=rest)
    return dataclasses.replace(found.recording, setup=setup), found.body


def _rest_pose(recording: mj.Recording, own: mj.Body, body: mj.Body) -> np.ndarray:
    """The declared rest pose on another body: retargeted, unless it is the same skeleton."""
    declared = declared_pose(recording.setup.rest, own)
    if body.topology.body_names == own.topology.body_names:
        # The declared pose of simulated recordings is the reference pose, carried by the root.
        pose = np.array(body.qpos0)
        pose[:7] = declared[:7]
        return pose
    time = np.arange(4) / 60.0
    still = Motion("rest", own, mj.Trajectory(time, np.tile(declared, (4, 1))), {})
    return np.asarray(mj.retarget(still, body).trajectory.q)[0]


def _leg(body: mj.Body) -> float:
    """Hip to ankle [m], mean of both sides."""
    place, index = np.asarray(body.body_pos), body.topology.body_index
    parts = [s + n for s in ("Left", "Right") for n in ("LowerLeg", "Foot")]
    return float(sum(np.linalg.norm(place[index(n)]) for n in parts) / 2)
