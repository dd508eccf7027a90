"""Reported angles of the human body are positive for the motions they are named after (ISB)."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.motion import human
from mocap_jax.motion.human.proportions import side_of
from mocap_jax.solution.anatomy import JointAngle, joint_angle_list
from mocap_jax.solution.angles import anatomical_rotations, joint_angles
from mocap_jax.solution.cardan import cardan_zxy
from mocap_jax.trajectory import Trajectory

BODY = human()
FRONT, UP, DOWN, BACK = (1, 0, 0), (0, 0, 1), (0, 0, -1), (-1, 0, 0)
LATERAL, MEDIAL, RIGHT, LEFT = (0, 1, 0), (0, -1, 0), (0, -1, 0), (0, 1, 0)
_LONG = {
    "flexion": (DOWN, FRONT), "abduction": (DOWN, LATERAL), "internal_rotation": (FRONT, MEDIAL),
}  # fmt: skip
# Which point of the segment goes where (left side; arms hang, palms to the thighs).
MOTIONS: dict[str, dict[str, tuple]] = {
    "UpperArm": _LONG,
    "UpperLeg": _LONG,
    "ForeArm": _LONG | {"pronation": (FRONT, MEDIAL)},
    "Hand": {"flexion": (DOWN, MEDIAL), "radial_deviation": (DOWN, FRONT),
             "pronation": (FRONT, MEDIAL)},
    "LowerLeg": {"flexion": (DOWN, BACK)},
    "Foot": {"dorsiflexion": (FRONT, UP), "eversion": (LATERAL, UP),
             "internal_rotation": (FRONT, MEDIAL)},
    "Toe": {"extension": (FRONT, UP)},
    "Shoulder": {"depression": (LATERAL, DOWN), "protraction": (LATERAL, FRONT),
                 "axial_rotation": (FRONT, UP)},
}  # fmt: skip
TRUNK = {"flexion": (UP, FRONT), "lateral_bending": (UP, RIGHT), "axial_rotation": (FRONT, LEFT)}
ANGLES = joint_angle_list(BODY)


def turn(angle: JointAngle) -> np.ndarray:
    """World rotation vector of 0.3 rad that is the named motion in the zero pose."""
    segment, motion = angle.name.split("/")
    side, part = side_of(segment)
    mirror = np.array([1, -1, 1]) if side == "Right" else np.ones(3)
    point, direction = (mirror * d for d in MOTIONS.get(part, TRUNK)[motion])
    return 0.3 * np.cross(point, direction)


def pose(body: Body, segment: int, w: np.ndarray) -> np.ndarray | None:
    """Pose with one joint turned; None where the segment has no such joint."""
    topology, q = body.topology, np.array(body.qpos0)
    for joint in topology.joints_of_body(segment):
        at = topology.joint_qpos[joint]
        if topology.joint_types[joint] == "ball":
            q[at : at + 4] = Rotation.from_rotvec(w).as_quat(scalar_first=True)
            return q
        share = float(np.asarray(body.joint_axis)[joint] @ w)
        if abs(share) > 0.29:
            q[at] = share
            return q
    return None


def reported(q: np.ndarray) -> dict[str, float]:
    names, values = joint_angles(BODY, Trajectory(jnp.zeros(1), jnp.array(q)[None]))
    return dict(zip(names, values[0], strict=True))


@pytest.mark.parametrize("angle", ANGLES, ids=lambda a: a.name)
def test_angle_is_positive_for_its_motion(angle: JointAngle) -> None:
    R = np.tile(np.eye(3), (1, BODY.topology.nbody, 1, 1))
    R[0, angle.segment] = Rotation.from_rotvec(turn(angle)).as_matrix()
    if angle.axis >= 0:  # also for directions in which the body has no joint
        zxy = cardan_zxy(anatomical_rotations(BODY, R))[0, angle.segment]
        expected = np.zeros(3)
        expected[angle.axis] = 0.3 * angle.sign
        np.testing.assert_allclose(zxy, expected, atol=1e-12)
    q = pose(BODY, angle.segment, turn(angle))
    if q is None:
        return
    angles = reported(q)
    assert angles.pop(angle.name) == pytest.approx(0.3)
    assert max(np.abs(v) for v in angles.values()) < 1e-9


def test_every_degree_of_freedom_has_an_angle() -> None:
    moved = [a for a in ANGLES if pose(BODY, a.segment, turn(a)) is not None]
    assert len(moved) == BODY.nv - 6
    assert all(v == pytest.approx(0.0, abs=1e-12) for v in reported(np.array(BODY.qpos0)).values())


@pytest.mark.parametrize("angle", ANGLES, ids=lambda a: a.name)
def test_hinges_named_after_an_angle_agree_with_it(angle: JointAngle) -> None:
    segment, motion = angle.name.split("/")
    opposite = {"inversion": "eversion", "elevation": "depression"}
    for joint in BODY.topology.joints_of_body(angle.segment):
        name = BODY.topology.joint_names[joint].removeprefix(f"{segment}_")
        if motion in (name, opposite.get(name)):
            q = np.array(BODY.qpos0)
            q[BODY.topology.joint_qpos[joint]] = 0.2
            expected = 0.2 if motion == name else -0.2
            assert reported(q)[angle.name] == pytest.approx(expected)
