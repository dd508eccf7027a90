"""What the kinematics does not represent is refused by name, and the place is named."""

from __future__ import annotations

import re

import pytest
from sample_models import sample_model

from mocap_jax.body import load_body
from mocap_jax.errors import InputError

MODEL = sample_model()
JOINT = re.search('<PinJoint name="pin">.*?</PinJoint>', MODEL).group(0)
LEADER = "<independent_coordinate_names>"

CASES = {
    "kind of joint": (
        MODEL.replace("PinJoint", "EllipsoidJoint"),
        "joint 'pin': EllipsoidJoint is not supported; valid: CustomJoint,",
    ),
    "function": (
        MODEL.replace("PolynomialFunction", "GCVSpline"),
        "joint 'knee', translation2: function GCVSpline is not supported",
    ),
    "several coordinates": (
        MODEL.replace("<coordinates>toe_angle<", "<coordinates>toe_angle other<", 1),
        "joint 'toe', rotation1: a function of several coordinates",
    ),
    "constraint": (
        MODEL.replace("CoordinateCouplerConstraint", "PointConstraint"),
        "constraint 'c0': PointConstraint is not supported; valid: CoordinateCouplerConstraint",
    ),
    "loop": (
        MODEL.replace(JOINT, JOINT + JOINT.replace('name="pin"', 'name="second"')),
        "body 'pin' is the child of two joints \\('pin' and 'second'\\); loops",
    ),
    "loose body": (
        MODEL.replace('<Body name="slider">', '<Body name="loose"></Body><Body name="slider">'),
        "body 'loose' is the child of no joint",
    ),
    "frame": (
        MODEL.replace("/bodyset/pin<", "/bodyset/nowhere<"),
        "there is no frame 'nowhere'; valid bodies: root",
    ),
    "prescribed": (
        MODEL.replace(
            '<Coordinate name="pin_angle">',
            '<Coordinate name="pin_angle"><prescribed>true</prescribed>',
        ),
        "coordinate 'pin_angle': prescribed motion is not supported",
    ),
    "no plain axis": (
        MODEL.replace("<coefficients>-1 0.1<", "<coefficients>-3 0.1<"),
        "joint 'knee': coordinate 'bend' moves no axis one to one",
    ),
    "circle": (
        MODEL.replace(f"{LEADER}pin_angle<", f"{LEADER}cap_beta<").replace(
            f"{LEADER}bend<", f"{LEADER}copy_angle<"
        ),
        "coordinate couplers follow each other",
    ),
    "entities": ('<!DOCTYPE x [<!ENTITY a "b">]>' + MODEL, "document type declarations"),
    "in between": (
        MODEL.replace("socket_parent_frame", "socket_parent_frame_connectee_name"),
        "must be opened and saved in OpenSim 4",
    ),
    "not XML": (MODEL[:-5], "not well-formed XML"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_refused(case: str):
    text, message = CASES[case]
    assert text != MODEL
    with pytest.raises(InputError, match=message):
        load_body(text)


def test_the_file_is_named(tmp_path):
    path = tmp_path / "mine.osim"
    path.write_text(MODEL.replace("PinJoint", "EllipsoidJoint"))
    with pytest.raises(InputError, match=r"mine\.osim: joint 'pin'"):
        load_body(path)
    path.write_text("<mujoco/>")
    with pytest.raises(InputError, match=r"mine\.osim: the document is <mujoco>"):
        load_body(path)


def test_constraints_that_are_off_do_not_matter():
    off = MODEL.replace(
        '<CoordinateCouplerConstraint name="c0">',
        '<CoordinateCouplerConstraint name="c0"><isEnforced>false</isEnforced>',
    )
    assert len(load_body(off).xml.split('"coupling/copy_angle"')) == 1
