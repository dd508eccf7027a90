"""Names of other systems for the 23 segments."""

from __future__ import annotations

import pytest

from mocap_jax.motion import XSENS_SEGMENTS, xsens_name


@pytest.mark.parametrize(
    ("name", "expected"),
    [("lfemur", "LeftUpperLeg"), ("root", "Pelvis"), ("thorax", "T8"),
     ("rclavicle", "RightShoulder"),
     ("LeftUpLeg", "LeftUpperLeg"), ("LeftArm", "LeftUpperArm"), ("lShldr", "LeftUpperArm"),
     ("RightToeBase", "RightToe"), ("mixamorig:Hips", "Pelvis"), ("lwrist", "lwrist"),
     ("femur_r", "RightUpperLeg"), ("talus_l", "LeftFoot"), ("calcn_l", "calcn_l"),
     ("torso", "T8"), ("ulna_r", "RightForeArm"), ("patella_r", "patella_r"),
     ("upperneck", "upperneck"), ("rButtock", "rButtock"), ("LHipJoint", "LHipJoint")],
)  # fmt: skip
def test_names_of_other_systems(name: str, expected: str) -> None:
    assert xsens_name(name) == expected
    assert xsens_name(expected) == expected


def test_own_names_are_kept() -> None:
    assert all(xsens_name(name) == name for name in XSENS_SEGMENTS)
