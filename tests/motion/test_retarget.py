"""Retargeting: exact on the clip's own body, small errors and sound anatomy on others."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion, human, load_motion, retarget, retarget_errors
from mocap_jax.trajectory import Trajectory


@pytest.fixture(scope="module")
def walk(shared_data: Path) -> Motion:
    """Every tenth frame of a walk."""
    motion = load_motion(shared_data / "cmu_mocap" / "02_01.amc")
    q, time = motion.trajectory.q[::10], motion.trajectory.time[::10]
    return dataclasses.replace(motion, trajectory=Trajectory(time, q))


def centres(body: Body, q: np.ndarray) -> dict[str, np.ndarray]:
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    data.qpos = np.asarray(q)
    mujoco.mj_kinematics(model, data)
    return {model.body(i).name: data.xpos[i].copy() for i in range(1, model.nbody)}


def direction(points: dict[str, np.ndarray], start: str, end: str) -> np.ndarray:
    axis = points[end] - points[start]
    return axis / np.linalg.norm(axis)


@pytest.mark.slow
def test_own_body_gets_its_own_motion_back(walk: Motion) -> None:
    again = retarget(walk, walk.body)
    assert again.facts["scale"] == pytest.approx(1.0)
    assert again.facts["orientation_error_max_deg"] < 2.0
    assert again.facts["position_error_max_cm"] < 0.5
    for frame in (0, 20):
        expected = centres(walk.body, walk.trajectory.q[frame])
        found = centres(again.body, again.trajectory.q[frame])
        for name, point in expected.items():
            np.testing.assert_allclose(found[name], point, atol=0.01, err_msg=name)


def test_human_walks_like_the_clip(walk: Motion) -> None:
    result = retarget(walk, human())
    assert result.body.nq == result.trajectory.q.shape[1]
    np.testing.assert_array_equal(result.trajectory.time, walk.trajectory.time)
    assert result.facts["orientation_error_mean_deg"] < 6.0
    assert result.facts["position_error_mean_cm"] < 1.5
    errors = retarget_errors(walk, result)
    assert errors["bend_mean_deg"].max() < 1.0
    assert (
        errors.filter(regex="(UpperArm|ForeArm|UpperLeg|LowerLeg)$", axis=0)[
            "direction_mean_deg"
        ].max()
        < 3.0
    )
    for frame in range(0, len(walk.trajectory.q), 8):
        source = centres(walk.body, walk.trajectory.q[frame])
        found = centres(result.body, result.trajectory.q[frame])
        assert -0.03 < min(p[2] for p in found.values()) < 0.12
        for side in ("Left", "Right"):
            for start, end in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"),
                               ("UpperArm", "ForeArm"), ("ForeArm", "Hand")):  # fmt: skip
                a = direction(source, side + start, side + end)
                b = direction(found, side + start, side + end)
                assert np.degrees(np.arccos(a @ b)) < 12, (frame, side, start)


@pytest.mark.slow
def test_dm_control_humanoid_takes_the_clip(walk: Motion, shared_data: Path) -> None:
    path = shared_data / "mjcf_humanoid_cmu" / "humanoid_CMU_V2020.xml"
    result = retarget(walk, load_body(path, free_root=True))
    assert result.facts["orientation_error_mean_deg"] < 4.0
    assert result.facts["position_error_mean_cm"] < 1.5
    points = centres(result.body, result.trajectory.q[0])
    assert points["head"][2] > points["root"][2] > points["ltibia"][2]


def test_bodies_that_cannot_take_a_motion_are_refused(walk: Motion) -> None:
    def body(inner: str, root: str = "<freejoint name='root'/>") -> Body:
        return load_body(
            f"<mujoco><worldbody><body name='a'>{root}<geom size='.1'/>{inner}</body></worldbody>"
            "</mujoco>"
        )

    with pytest.raises(InputError, match="needs a body with a free root"):
        retarget(walk, body("", "<joint name='h'/>"))
    with pytest.raises(InputError, match="the target body has no segment Pelvis; its segments: a"):
        retarget(walk, body(""))
